"use strict";
// A cursor at one instant: pointing at a chart over time shows the same instant in all such charts of the page and the
// same sample in the loops. It is drawn above the charts, which are not drawn anew.

const SVG_SPACE = "http://www.w3.org/2000/svg";
const KEY_STEP = 0.01; // of the time shown

let wanted; // { chart, time }: s on that chart's clock; undefined for none
let frame;

function showInstant(chart, time) {
  wanted = time === undefined ? undefined : { chart, time };
  frame ??= requestAnimationFrame(() => {
    frame = undefined;
    for (const one of charts) if (one.area.isConnected) one.cursor?.show(timeOn(one));
  });
}

// Charts without the time of their first sample have a clock of their own.
function timeOn(chart) {
  if (wanted === undefined || wanted.chart === chart) return wanted?.time;
  const [start, own] = [wanted.chart.spec.usermeta.start, chart.spec.usermeta.start];
  return start === undefined || own === undefined ? undefined : wanted.time + (start - own) / 1e3;
}

// A line of a chart: its points in order of time.
class Curve {
  constructor(meta, label, rows) {
    const usable = rows.filter((row) => row.time !== null && row[meta.x] !== null && row[meta.y] !== null);
    this.rows = usable.sort((one, other) => one.time - other.time);
    this.label = label === undefined ? meta.names.y : `${label}, ${meta.names.y}`;
    Object.assign(this, { x: meta.x, y: meta.y, names: meta.names, isPath: meta.x !== "time" });
  }

  // The row after this time.
  after(time) {
    let [low, high] = [0, this.rows.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.rows[middle].time < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // Lines are drawn straight between their points, but not over a gap.
  at(time) {
    const next = this.after(time);
    const [before, following] = [this.rows[next - 1], this.rows[next]];
    if (following?.time === time) return following;
    if (before === undefined || following === undefined || before.piece !== following.piece) return undefined;
    const share = (time - before.time) / (following.time - before.time);
    const between = (field) => before[field] + share * (following[field] - before[field]);
    return { time, [this.x]: between(this.x), [this.y]: between(this.y) };
  }
}

class Cursor {
  constructor(chart) {
    this.chart = chart;
    this.drawing = document.createElementNS(SVG_SPACE, "svg");
    this.drawing.setAttribute("class", "cursor");
    this.drawing.setAttribute("aria-hidden", "true");
    const canvas = chart.canvas();
    this.drawing.setAttribute("width", canvas.clientWidth);
    this.drawing.setAttribute("height", canvas.clientHeight);
    canvas.after(this.drawing);
    this.panels = chart.panels.map((panel) => {
      const curves = panel.meta.curves.flatMap((meta) => this.curvesOf(meta));
      return { panel, curves, line: panel.isOfTime ? this.add("line") : undefined, dots: curves.map(() => this.add("circle")) };
    });
    for (const { panel, curves } of this.panels.filter((one) => one.curves.length > 0)) {
      for (const axis of Object.keys(panel.meta.axes)) {
        panel.view.addSignalListener(panel.signal(axis), () => wanted && showInstant(wanted.chart, wanted.time));
      }
    }
  }

  curvesOf(meta) {
    const rows = this.chart.spec.datasets[meta.data];
    if (meta.of === null) return [new Curve(meta, undefined, [...rows])];
    const labels = Object.entries(meta.labels);
    return labels.map(([label, said]) => new Curve(meta, said, rows.filter((row) => row[meta.of] === label)));
  }

  add(shape) {
    const made = document.createElementNS(SVG_SPACE, shape);
    made.setAttribute("visibility", "hidden");
    if (shape === "circle") made.setAttribute("r", 4);
    this.drawing.append(made);
    return made;
  }

  show(time) {
    const values = [];
    let named;
    for (const { panel, curves, line, dots } of this.panels) {
      const [x, y] = [panel.scale("x"), panel.scale("y")];
      const across = (value) => panel.left + x(value);
      const up = (value) => panel.top + y(value);
      if (line !== undefined) {
        const place = time === undefined ? NaN : across(time);
        this.set(line, panel.has(place, panel.top), { x1: place, x2: place, y1: panel.top, y2: panel.top + panel.height });
      }
      curves.forEach((curve, number) => {
        const point = time === undefined ? undefined : curve.at(time);
        const place = { cx: point && across(point[curve.x]), cy: point && up(point[curve.y]) };
        this.set(dots[number], point !== undefined && panel.has(place.cx, place.cy), place);
        if (point === undefined || curve.isPath) return;
        named = curve.names.time;
        values.push(`${curve.label}: ${inBrief(point[curve.y])}`);
      });
    }
    const unique = [...new Set(values)];
    this.chart.readout.textContent = unique.length === 0 ? "" : [`${named}: ${time.toFixed(2)}`, ...unique].join(" · ");
  }

  set(shape, isShown, place) {
    shape.setAttribute("visibility", isShown ? "visible" : "hidden");
    if (isShown) for (const [name, value] of Object.entries(place)) shape.setAttribute(name, value);
  }

  // The time under the pointer: of a chart over time, or of the nearest point of a loop.
  timeAt({ x, y }) {
    const under = this.panels.find(({ panel }) => panel.has(x, y));
    if (under === undefined || under.curves.length === 0) return undefined;
    const { panel, curves } = under;
    if (panel.isOfTime) return panel.scale("x").invert(x - panel.left);
    let [nearest, least] = [undefined, Infinity];
    for (const row of curves[0].rows) {
      const [across, along] = [panel.left + panel.scale("x")(row[curves[0].x]) - x, panel.top + panel.scale("y")(row[curves[0].y]) - y];
      const distance = across * across + along * along;
      if (distance < least) [nearest, least] = [row.time, distance];
    }
    return nearest;
  }

  // By a step of what is shown, from the middle of it if no instant is.
  step(direction) {
    const shown = this.panels.find(({ panel }) => panel.isOfTime)?.panel.scale("x").domain();
    if (shown === undefined) return false;
    const [first, last] = shown;
    const now = timeOn(this.chart) ?? (first + last) / 2;
    showInstant(this.chart, Math.min(last, Math.max(first, now + direction * KEY_STEP * (last - first))));
    return true;
  }
}
