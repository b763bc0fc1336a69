"use strict";
// Replaces a still picture by a live chart: values under the pointer, zoom (zoom.js), a cursor that all charts share
// (instant.js), downloads. Where a chart cannot be drawn its picture stays. The policy of the pages forbids eval and
// styles in markup, so Vega interprets its expressions.

const LIBRARY = document.currentScript.dataset.library;
const NARROW = 560; // CSS pixels; panels beside each other would be too small
const AXIS = 80; // CSS pixels beside a panel, for its vertical axis
const LEAST = 120; // CSS pixels of a panel
const AHEAD = "300px"; // charts this near to the screen are drawn
const PAUSES = [1, 3, 10]; // s, before a chart that a busy server did not give is asked for again
const SHARPNESS = 2; // pixels of a saved picture per CSS pixel
const WORDS = { // inWords is of theme.js
  chart: inWords("chart"),
  help: inWords("Help"),
  keys: inWords("Zoom: + and − keys, Ctrl and the wheel, or two fingers. Move: arrow keys, the mouse, or a finger sideways. Reset: 0 or Escape."),
  cursor: inWords("Shift with ← or → moves the cursor in time, which all charts of the page show."),
};

let library;
let helps = 0; // texts of help on the page

function loaded() {
  library ??= new Promise((done, failed) => {
    const script = document.createElement("script");
    script.src = LIBRARY;
    script.onload = done;
    script.onerror = (error) => {
      library = undefined; // the next chart asks for it again
      failed(error);
    };
    document.head.append(script);
  });
  return library;
}

async function answered(address) {
  for (const pause of PAUSES) {
    const answer = await fetch(address, { credentials: "same-origin" }).catch(() => undefined);
    if (answer !== undefined && answer.status < 500) return answer;
    await new Promise((done) => setTimeout(done, 1e3 * pause));
  }
  return fetch(address, { credentials: "same-origin" });
}

function isDark() {
  return theme() === "dark"; // of theme.js
}

function changed(value, change) {
  if (Array.isArray(value)) return value.map((one) => changed(one, change));
  if (value === null || typeof value !== "object") return value;
  const made = {};
  for (const [name, one] of Object.entries(value)) made[name] = name === "datasets" || name === "values" ? one : changed(one, change);
  return change(made);
}

function withConfig(spec, config) {
  const made = { ...spec.config };
  for (const [name, one] of Object.entries(config)) made[name] = typeof one === "object" ? { ...made[name], ...one } : one;
  return { ...spec, config: made };
}

function withLegendsBelow(spec) {
  return withConfig(spec, { legend: { orient: "bottom", columns: 1 } });
}

function withShortTitles(spec, most) { // a long title would leave little room for the panel
  return withConfig(spec, { title: { limit: most - AXIS } });
}

function inTheme(spec) {
  if (!isDark()) return withConfig(spec, { background: "white" });
  const { colours, config } = spec.usermeta.dark;
  const change = (one) => {
    for (const [name, value] of Object.entries(one)) {
      if (typeof value === "string" && value in colours) one[name] = colours[value];
      else if (name === "range" && Array.isArray(value)) one[name] = value.map((each) => colours[each] ?? each);
    }
    return one;
  };
  return withConfig(changed(spec, change), config);
}

function stacked(spec) {
  return changed(spec, (one) => {
    if (one.hconcat !== undefined) { // one below the other
      const { hconcat, ...rest } = one;
      return { ...rest, vconcat: hconcat };
    }
    return one.concat === undefined ? one : { ...one, columns: 1 };
  });
}

function within(spec, most) {
  return changed(spec, (one) => (typeof one.width === "number" && one.width > most ? { ...one, width: most } : one));
}

function withAxes(spec, axes) {
  return changed(spec, (one) => {
    for (const axis of axes) {
      const scale = one[axis]?.scale ?? {};
      if (one[axis]?.type !== "quantitative") continue;
      one[axis] = { ...one[axis], scale: { ...scale, type: scale.type === "log" ? "linear" : "log", zero: false } };
    }
    return one;
  });
}

// When an axis first changes, Vega-Lite's brush looks for its window where there is none.
function withGuardedBrush(compiled) {
  return changed(compiled, (one) => {
    const asked = one.events?.signal?.endsWith?.("_scale_trigger") && /(\w+)\[0\]/.exec(one.update);
    return asked ? { ...one, update: `isArray(${asked[1]}) ? ${one.update} : []` } : one;
  });
}

function saved(address, name) {
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
}

class Chart {
  constructor(figure, spec) {
    this.figure = figure;
    this.spec = spec;
    this.still = figure.querySelector("img");
    this.title = figure.querySelector("figcaption b").textContent.replace(/[.。]$/, "");
    this.area = document.createElement("div");
    this.area.className = "live";
    this.readout = document.createElement("p");
    this.readout.className = "readout";
    this.panels = [];
    this.hasOtherAxes = false;
    this.isOld = false; // what it shows is no longer what it should
    this.beside = AXIS; // CSS pixels beside a panel, as last drawn in a narrow place
  }

  // Resolves once the chart is as it should be. What changes during a drawing is drawn next, all of it at once.
  draw() {
    this.isOld = true;
    this.drawing ??= this.drawUntilNew();
    return this.drawing;
  }

  async drawUntilNew() {
    try {
      while (this.isOld) {
        this.isOld = false;
        await this.drawNow();
      }
    } finally {
      this.drawing = undefined;
    }
  }

  async drawNow() {
    const room = this.figure.clientWidth;
    if (room === 0) return; // it is not shown, as on paper
    let spec = this.hasOtherAxes ? withAxes(this.spec, this.spec.usermeta.log) : this.spec;
    spec = inTheme(spec);
    const isNarrow = room < NARROW;
    if (isNarrow) spec = within(stacked(withLegendsBelow(withShortTitles(spec, room))), room - this.beside);
    await this.embed(spec);
    for (let tries = 0; tries < 3 && !this.isOld && this.canvasWidth() > room; tries += 1) {
      spec = within(spec, Math.max(LEAST, this.widest(spec) - (this.canvasWidth() - room) - 1));
      if (isNarrow) this.beside = room - this.widest(spec); // fits at once in the next narrow place
      await this.embed(spec);
    }
    if (this.isOld) return;
    this.canvas().setAttribute("role", "img");
    this.canvas().setAttribute("aria-label", spec.description ?? this.still.alt);
    this.panels = panelsOf(this.view, this.spec.usermeta.panels);
    if (this.panels.length > 0) this.takeKeys();
    this.cursor = new Cursor(this);
    if (wanted !== undefined) showInstant(wanted.chart, wanted.time);
  }

  takeKeys() {
    this.area.tabIndex = 0;
    this.area.setAttribute("role", "application"); // a screen reader passes the keys on
    this.area.setAttribute("aria-roledescription", WORDS.chart);
    this.area.setAttribute("aria-label", this.title);
  }

  canvas() {
    return this.area.querySelector("canvas");
  }

  async embed(spec) {
    this.result?.finalize();
    this.result = await vegaEmbed(this.area, spec, {
      actions: false,
      ast: true,
      defaultStyle: false,
      patch: withGuardedBrush,
      renderer: "canvas",
      tooltip: { disableDefaultStyle: true },
    });
    this.view = this.result.view;
  }

  canvasWidth() {
    return this.canvas().getBoundingClientRect().width;
  }

  widest(spec) {
    let most = 0;
    changed(spec, (one) => {
      if (typeof one.width === "number") most = Math.max(most, one.width);
      return one;
    });
    return most;
  }

  show() {
    this.still.after(this.area, this.readout);
    this.still.hidden = true;
  }

  listen() {
    listenToTouch(this);
    for (const pointed of ["pointermove", "pointerdown"]) {
      this.area.addEventListener(pointed, (event) => this.point(event), { capture: true });
    }
    this.area.addEventListener("pointerleave", (event) => {
      if (event.pointerType === "mouse" && this.hasTime()) showInstant(this, undefined);
    });
    this.area.addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.altKey || event.metaKey) && this.press(event)) event.preventDefault();
    });
  }

  hasTime() {
    return this.panels.some((panel) => panel.meta.curves.length > 0);
  }

  point(event) {
    if (this.cursor === undefined || !this.hasTime()) return;
    const time = this.cursor.timeAt(placeOn(this.canvas(), event));
    this.readout.setAttribute("aria-live", "off"); // a pointer moves faster than anybody reads aloud
    if (time !== undefined) showInstant(this, time);
  }

  // Whether the key meant something.
  press({ key, shiftKey }) {
    this.readout.setAttribute("aria-live", "polite");
    if (key === "0" || key === "Escape") {
      showInstant(this, undefined);
      this.draw();
      return true;
    }
    if (shiftKey && (key === "ArrowLeft" || key === "ArrowRight")) return this.cursor.step(key === "ArrowLeft" ? -1 : 1);
    if (!(key in ZOOMS || key in ARROWS) || this.panels.length === 0) return false;
    const shown = zoomByKey(this, key);
    if (shown === undefined) return false;
    if (wanted === undefined) this.readout.textContent = shown.join(" · ");
    return true;
  }

  addTools() {
    const tools = document.createElement("p");
    tools.className = "tools";
    const name = this.title.replace(/[^\p{L}\p{N}_]+/gu, "-").toLowerCase();
    const csv = this.figure.dataset.chart.replace(".json?", ".csv?");
    const add = (words, act) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = words;
      button.setAttribute("aria-label", `${words}: ${this.title}`);
      button.addEventListener("click", () => act(button));
      tools.append(button);
    };
    add(inWords("Reset zoom"), () => this.draw());
    if (this.spec.usermeta.log) {
      add(inWords("Log or linear axis"), () => {
        this.hasOtherAxes = !this.hasOtherAxes;
        return this.draw();
      });
    }
    add("PNG", async () => saved(await this.view.toImageURL("png", SHARPNESS), `${name}.png`));
    add("SVG", async () => saved(await this.view.toImageURL("svg"), `${name}.svg`));
    add("CSV", () => saved(csv, `${name}.csv`));
    if (this.panels.length > 0) tools.append(this.help());
    this.readout.after(tools);
  }

  help() {
    const help = document.createElement("details");
    const summary = document.createElement("summary");
    const words = document.createElement("span");
    helps += 1;
    words.id = `help-${helps}`;
    words.textContent = this.hasTime() ? `${WORDS.keys} ${WORDS.cursor}` : WORDS.keys;
    summary.textContent = WORDS.help;
    summary.setAttribute("aria-label", `${WORDS.help}: ${this.title}`);
    help.append(summary, words);
    this.area.setAttribute("aria-describedby", words.id);
    return help;
  }
}

async function alive(figure) {
  const answer = await answered(figure.dataset.chart);
  if (!answer.ok) return;
  const [spec] = await Promise.all([answer.json(), loaded()]);
  const chart = new Chart(figure, spec);
  chart.show();
  try {
    await chart.draw();
  } catch (error) {
    chart.area.remove();
    chart.readout.remove();
    chart.still.hidden = false;
    throw error;
  }
  chart.addTools();
  chart.listen();
  charts.push(chart);
}

const charts = [];
const nearby = new IntersectionObserver(
  (seen) => {
    for (const { target } of seen.filter((entry) => entry.isIntersecting)) {
      nearby.unobserve(target);
      const chart = charts.find((one) => one.figure === target);
      if (chart === undefined) alive(target);
      else chart.draw();
    }
  },
  { rootMargin: AHEAD },
);

function watch() {
  for (const figure of document.querySelectorAll("figure[data-chart]:not([data-watched])")) {
    figure.dataset.watched = "";
    nearby.observe(figure);
  }
}

function redraw() { // those near the screen at once, the others when they come near it
  for (const chart of charts) nearby.observe(chart.figure);
}

let width = innerWidth;
addEventListener("resize", () => {
  if (innerWidth === width) return; // a phone's address bar came or went
  width = innerWidth;
  redraw();
});
document.addEventListener("themechange", redraw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
new MutationObserver(watch).observe(document.querySelector("main"), { childList: true, subtree: true });
watch();
