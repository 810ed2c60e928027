"use strict";
// Curves over time and the fundamental diagram, as SVG; a line marks the time shown.

/** Sizes in the units of the drawing, and about how many ticks there is room for (document.py). */
const CHART = { width: 340, height: 150, left: 52, right: 18, top: 8, bottom: 22, times: 5, levels: 3 };
const SMALL_CHART = { width: 190, height: 104, left: 36, right: 16, top: 7, bottom: 20, times: 2, levels: 2 };

function svg(tag, attributes = {}, text = null) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== null) made.textContent = text;
  return made;
}

/** Round numbers from 0 up to at least the greatest, about so many. */
function ticks(greatest, about = 4) {
  if (!(greatest > 0)) return [0, 1];
  const rough = greatest / about;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 2.5, 5, 10].find((factor) => factor * power >= rough * 0.999);
  const found = [];
  for (let i = 0; i * step < greatest * 1.001 + step; i++) found.push(i * step);
  return found;
}

function largest(values) {
  return values.reduce((most, value) => (value > most ? value : most), 0);
}

function digitsOf(step) {
  return step >= 1 ? 0 : Math.ceil(-Math.log10(step));
}

/** What both kinds of chart share: the frame, its scales, and the caption. */
class Chart {
  constructor(parent, title, xTicks, yTicks, box = CHART) {
    this.box = box;
    this.x = this.scale(xTicks, this.box.left, this.box.width - this.box.right);
    this.y = this.scale(yTicks, this.box.height - this.box.bottom, this.box.top);
    this.value = element("span");
    this.svg = svg("svg", {
      viewBox: `0 0 ${this.box.width} ${this.box.height}`, class: "chart", role: "img",
    });
    const step = yTicks[1] - yTicks[0];
    for (const tick of yTicks) {
      const y = this.y(tick);
      this.add("line", { x1: this.box.left, x2: this.box.width - this.box.right, y1: y, y2: y, class: "grid" });
      this.add("text", { x: this.box.left - 5, y: y + 3.5, "text-anchor": "end" }, told(tick, digitsOf(step)));
    }
    this.caption = element("figcaption", {}, element("span", {}, ...title), this.value);
    this.figure = element("figure", {}, this.caption, this.svg);
    parent.append(this.figure);
  }

  scale(steps, from, to) {
    const low = steps[0], span = steps[steps.length - 1] - low || 1;
    return (value) => from + ((value - low) / span) * (to - from);
  }

  add(tag, attributes, text = null) {
    const made = svg(tag, attributes, text);
    this.svg.append(made);
    return made;
  }
}

/** One or two quantities over time, constant within each time step. */
class TimeChart extends Chart {
  /** series: {label, values, digits}; options: reference (a level), unit, go (told a clicked step) */
  constructor(parent, run, title, series, { reference = null, unit = "", go = null, box = CHART } = {}) {
    const most = Math.max(...series.map((one) => largest(one.values)), reference ?? 0);
    super(parent, TimeChart.caption(title, series), [run.edges[0], run.edges[run.bins]],
      ticks(most, box.levels), box);
    this.run = run;
    this.series = series;
    this.unit = unit;
    this.drawClock();
    if (reference !== null) {
      const y = this.y(reference);
      this.add("line", {
        x1: this.box.left, x2: this.box.width - this.box.right, y1: y, y2: y, class: "reference",
      });
    }
    series.forEach((one, number) => {
      this.add("path", { d: this.steps(one.values), class: number ? "line second" : "line" });
    });
    this.now = this.add("line", { y1: this.box.top, y2: this.box.height - this.box.bottom, class: "now" });
    this.svg.setAttribute("aria-label", `${title} over time, at most ${told(most, 1)} ${unit}`);
    if (go) this.svg.addEventListener("click", (event) => go(this.binAt(event)));
  }

  static caption(title, series) {
    if (series.length === 1) return [element("b", {}, title)];
    const keys = series.map((one, number) => element(
      "span", { class: number ? "key second" : "key" }, `${number ? " ┅ " : " ━ "}${one.label}`,
    ));
    return [element("b", {}, title), ...keys];
  }

  steps(values) {
    let path = "", drawing = false;
    values.forEach((value, bin) => {
      if (value === null || Number.isNaN(value)) {
        drawing = false;
        return;
      }
      const [from, to] = [this.x(this.run.edges[bin]), this.x(this.run.edges[bin + 1])];
      const y = this.y(value).toFixed(1);
      path += `${drawing ? "L" : "M"}${from.toFixed(1)} ${y}L${to.toFixed(1)} ${y}`;
      drawing = true;
    });
    return path;
  }

  drawClock() {
    const y = this.box.height - this.box.bottom;
    for (const [time, text] of this.run.content.ticks[this.box.times]) {
      this.add("line", { x1: this.x(time), x2: this.x(time), y1: y, y2: y + 4, class: "grid" });
      this.add("text", { x: this.x(time), y: y + 15, "text-anchor": "middle" }, text);
    }
  }

  binAt(event) {
    const box = this.svg.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * this.box.width;
    const share = (x - this.box.left) / (this.box.width - this.box.left - this.box.right);
    const { edges, bins } = this.run;
    const time = edges[0] + share * (edges[bins] - edges[0]);
    const bin = edges.findIndex((edge) => edge > time) - 1;
    return Math.min(Math.max(bin, 0), bins - 1);
  }

  mark(bin) {
    const x = this.x((this.run.edges[bin] + this.run.edges[bin + 1]) / 2);
    this.now.setAttribute("x1", x);
    this.now.setAttribute("x2", x);
    const values = this.series.map((one) => told(one.values[bin], one.digits ?? 0));
    this.value.textContent = `${values.join(" / ")} ${this.unit}`;
  }
}

/** Production over accumulation: a dot a time step, joined in their order. */
class DiagramChart extends Chart {
  constructor(parent, run, go) {
    const { accumulation, production } = run.content.network;
    const xTicks = ticks(largest(accumulation), 4);
    super(parent, [element("b", {}, "Macroscopic fundamental diagram")], xTicks,
      ticks(largest(production), 3));
    this.points = accumulation.map((vehicles, bin) => [this.x(vehicles), this.y(production[bin])]);
    for (const tick of xTicks) {
      this.add("text", { x: this.x(tick), y: this.box.height - 7, "text-anchor": "middle" }, told(tick));
    }
    const path = this.points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L");
    this.add("path", { d: `M${path}`, class: "grid", fill: "none" });
    this.points.forEach(([cx, cy], bin) => {
      const dot = this.add("circle", { cx, cy, r: 2.6, class: "dot" });
      dot.addEventListener("click", () => go(bin));
    });
    this.now = this.add("circle", { r: 5.5, class: "now-dot" });
    this.svg.setAttribute("aria-label", "Vehicle-kilometres per hour over vehicles on the road");
    this.figure.append(element(
      "p", { class: "quiet" }, "Upwards: vehicle-km per hour. To the right: vehicles on the road.",
    ));
    this.run = run;
  }

  mark(bin) {
    const [cx, cy] = this.points[bin];
    this.now.setAttribute("cx", cx);
    this.now.setAttribute("cy", cy);
    const { accumulation, production } = this.run.content.network;
    this.value.textContent = `${told(accumulation[bin])} veh, ${told(production[bin])} veh·km/h`;
  }
}

/** The charts of the whole network; calls go with the time step that was clicked. */
function networkCharts(parent, run, go) {
  const { network } = run.content;
  const over = (title, series, options) => new TimeChart(parent, run, title, series, { go, ...options });
  return [
    over("Vehicles", [
      { label: "on the road", values: network.running },
      { label: "waiting to enter", values: network.waiting },
    ], { unit: "veh" }),
    over("Vehicles in queues", [{ label: "", values: network.queue }], { unit: "veh" }),
    over("Mean speed", [{ label: "", values: network.speed, digits: 1 }], { unit: "km/h" }),
    over("Arrivals", [{ label: "", values: network.arrivals }], { unit: "veh/h" }),
    new DiagramChart(parent, run, go),
  ];
}
