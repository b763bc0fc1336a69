"use strict";
// Zoom of a live chart by touch and by keyboard, beside that of Vega by wheel and mouse. Two fingers zoom and move, one
// finger moves sideways or brushes a window, and a vertical swipe scrolls the page. A domain never exceeds that of the whole chart.

const SLOP = 8; // CSS pixels that a finger moves before it means something
const SPREAD = 40; // CSS pixels between two fingers along an axis, below which that axis only moves
const KEY_ZOOM = 1.5; // factor of a key
const KEY_MOVE = 0.2; // of the panel's width

class Panel {
  constructor(view, meta, mark, group, left, top) {
    Object.assign(this, { view, meta, left, top, width: group.width, height: group.height, own: group.context.signals });
    const prefix = (mark.name ?? "").replace(/(^|_)group$/, "$1").replace(/^root$/, "");
    this.names = { x: `${prefix}x`, y: `${prefix}y` };
    this.whole = { x: this.scale("x").copy(), y: this.scale("y").copy() };
    this.isOfTime = meta.curves.some((one) => one.x === "time");
  }

  scale(axis) {
    return this.view.scale(this.names[axis]);
  }

  signal(axis) { // as Vega-Lite names it
    return `${this.meta.zoom}_${this.meta.axes[axis]}`.replace(/\W/g, "_");
  }

  has(x, y) {
    return x >= this.left && x <= this.left + this.width && y >= this.top && y <= this.top + this.height;
  }

  // Shows what `from`, a scale, has at the pixels that `seen` gives for the two ends.
  look(axis, from, seen) {
    if (!(axis in this.meta.axes)) return;
    const whole = this.whole[axis];
    const [first, last] = whole.range();
    const ends = [first, last].map((end) => whole(from.invert(seen(end))));
    const size = Math.abs(last - first);
    const extent = Math.abs(ends[1] - ends[0]);
    if (!(extent < size)) {
      this.view.signal(this.signal(axis), null);
      return;
    }
    const low = Math.min(first, last);
    const beyond = Math.min(0, Math.min(...ends) - low) + Math.max(0, Math.max(...ends) - low - size);
    const domain = ends.map((end) => Number(whole.invert(end - beyond)));
    this.view.signal(this.signal(axis), domain);
  }

  zoom(axis, factor) {
    const scale = this.scale(axis).copy();
    const [first, last] = scale.range();
    const middle = (first + last) / 2;
    this.look(axis, scale, (end) => middle + (end - middle) / factor);
  }

  move(axis, share) {
    const scale = this.scale(axis).copy();
    const [first, last] = scale.range();
    this.look(axis, scale, (end) => end + share * Math.abs(last - first));
  }

  clearBrush() {
    this.view.update(this.own[`${this.meta.brush}_x`], []).runAsync();
  }

  isZoomed(axis) {
    return String(this.scale(axis).domain().map(Number)) !== String(this.whole[axis].domain().map(Number));
  }
}

// The panels of a drawn chart that can be zoomed, each with its place on the canvas.
function panelsOf(view, metas) {
  const found = [];
  const padding = view.padding();
  const visit = (mark, left, top) => {
    if (mark.marktype !== "group") return;
    for (const group of mark.items) {
      const place = [left + (group.x ?? 0), top + (group.y ?? 0)];
      const own = group.context?.signals ?? {};
      const meta = metas.find((one) => Object.hasOwn(own, `${one.zoom}_tuple`));
      if (meta !== undefined) found.push(new Panel(view, meta, mark, group, ...place));
      else for (const inner of group.items) visit(inner, ...place);
    }
  };
  visit(view.scenegraph().root, padding.left + view.origin()[0], padding.top + view.origin()[1]);
  return found;
}

function placeOn(canvas, touch) {
  const box = canvas.getBoundingClientRect();
  return { x: touch.clientX - box.left, y: touch.clientY - box.top };
}

// Fingers on a panel: what was under them stays under them. Along an axis on which two are close, the panel moves.
class Touch {
  constructor(panel, fingers) {
    this.panel = panel;
    this.start = fingers;
    this.scales = { x: panel.scale("x").copy(), y: panel.scale("y").copy() };
    this.isMeant = fingers.length === 2; // one finger may be about to scroll the page
  }

  follow(now) {
    if (!this.isMeant) {
      const [across, along] = ["x", "y"].map((axis) => Math.abs(now[0][axis] - this.start[0][axis]));
      if (Math.max(across, along) < SLOP) return true;
      if (along > across) return false;
      this.isMeant = true;
    }
    for (const axis of ["x", "y"]) {
      const edge = axis === "x" ? this.panel.left : this.panel.top;
      const [a, b, c, d] = [this.start[0], this.start.at(-1), now[0], now.at(-1)].map((one) => one[axis] - edge);
      const isApart = Math.abs(b - a) > SPREAD && Math.abs(d - c) > SPREAD;
      const ratio = isApart ? (b - a) / (d - c) : 1;
      this.panel.look(axis, this.scales[axis], (end) => (a + b) / 2 + (end - (c + d) / 2) * ratio);
    }
    this.panel.view.runAsync();
    return true;
  }
}

function listenToTouch(chart) {
  let touch;
  const fingersOf = (event) => [...event.touches].slice(0, 2).map((one) => placeOn(chart.canvas(), one));
  const begin = (event) => {
    const fingers = fingersOf(event);
    const [first, last] = [fingers[0], fingers.at(-1)];
    if (fingers.length === 2) event.preventDefault(); // the page does not scroll
    const panel = first && chart.panels.find((one) => one.has((first.x + last.x) / 2, (first.y + last.y) / 2));
    touch = panel && (fingers.length === 2 || panel.meta.brush === null) ? new Touch(panel, fingers) : undefined;
  };
  const move = (event) => {
    if (touch === undefined) return;
    if (!touch.follow(fingersOf(event))) touch = undefined;
    else if (touch.isMeant && event.cancelable) event.preventDefault();
  };
  const end = () => {
    touch = undefined;
  };
  // Vega follows a finger that brushes a window, and no other.
  let brushed;
  const keepFromVega = (event) => {
    if (event.pointerType !== "touch") return;
    const place = placeOn(chart.canvas(), event);
    const panel = chart.panels.find((one) => one.has(place.x, place.y));
    brushed = event.isPrimary && panel?.meta.brush ? panel : undefined;
    if (brushed === undefined) event.stopPropagation();
  };
  const cancel = () => {
    dispatchEvent(new PointerEvent("pointerup")); // for Vega: the page scrolls instead
    brushed?.clearBrush();
    brushed = undefined;
  };
  chart.area.addEventListener("pointerdown", keepFromVega, { capture: true });
  chart.area.addEventListener("pointercancel", cancel);
  chart.area.addEventListener("touchstart", begin, { passive: false });
  chart.area.addEventListener("touchmove", move, { passive: false });
  chart.area.addEventListener("touchend", end);
  chart.area.addEventListener("touchcancel", end);
}

const ARROWS = { ArrowLeft: ["x", -KEY_MOVE], ArrowRight: ["x", KEY_MOVE], ArrowUp: ["y", -KEY_MOVE], ArrowDown: ["y", KEY_MOVE] };
const ZOOMS = { "+": KEY_ZOOM, "=": KEY_ZOOM, "-": 1 / KEY_ZOOM, _: 1 / KEY_ZOOM };

// The panels over time zoom together and along time alone; a loop beside them stays whole.
function zoomByKey(chart, key) {
  const ofTime = chart.panels.filter((one) => one.isOfTime);
  const [panels, axes] = ofTime.length > 0 ? [ofTime, ["x"]] : [chart.panels, ["x", "y"]];
  if (key in ZOOMS) {
    for (const panel of panels) for (const axis of axes) panel.zoom(axis, ZOOMS[key]);
  } else {
    const [axis, share] = ARROWS[key];
    const movable = panels.filter((one) => axes.includes(axis) && one.isZoomed(axis));
    if (movable.length === 0) return undefined; // the page scrolls
    for (const panel of movable) panel.move(axis, share);
  }
  chart.view.run();
  return axes.map((axis) => {
    const ends = panels[0]?.scale(axis).domain();
    const name = panels[0]?.meta.curves[0]?.names[axis] ?? axis;
    return `${name}: ${ends.map(inBrief).join(" – ")}`;
  });
}

function inBrief(value) {
  return value instanceof Date ? value.toISOString().slice(0, 16).replace("T", " ") : String(Number(value.toPrecision(4))).replace("-", "−");
}
