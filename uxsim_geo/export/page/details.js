"use strict";
// The chosen link: what it is, what happens on it now, and its curves; and what hovering shows.

class Details {
  constructor(run, panel, calls) {
    this.run = run;
    this.panel = panel;
    this.calls = calls;
    this.charts = [];
    this.link = null;
    this.empty = [...panel.childNodes];
  }

  /** Show what stood there before a link was chosen. */
  clear() {
    this.charts = [];
    this.link = null;
    this.panel.replaceChildren(...this.empty);
  }

  /** Show a link; others are those of its street, to step through. */
  show(link, others, bin) {
    this.link = link;
    this.panel.replaceChildren();
    const { run } = this;
    this.panel.append(element("h3", {}, run.name(link)));
    if (others.length > 1) this.panel.append(this.steps(link, others));
    this.now = element("dl", { class: "figures" });
    const box = element("div", { class: "link-charts" });
    this.panel.append(this.now, box, this.attributes(link));
    const steps = Array.from({ length: run.bins }, (_, step) => step);
    const curve = (key) => steps.map((step) => run[key](link, step));
    const add = (title, key, digits, options) => new TimeChart(
      box, run, title, [{ label: "", values: curve(key), digits }], { go: this.calls.go, box: SMALL_CHART, ...options },
    );
    this.charts = [
      add("Speed (dots: free)", "speed", 1, { unit: "km/h", reference: run.links.free_kmh[link] }),
      add("Volume (dots: capacity)", "volume", 0, { unit: "veh/h", reference: run.links.capacity_vph[link] }),
      add("Density", "density", 1, { unit: "veh/km" }),
      add("Queue", "queue", 0, { unit: "m" }),
    ];
    this.mark(bin);
  }

  /** Buttons to the street's other links, those with most delay first. */
  steps(link, others) {
    const place = others.indexOf(link);
    const to = (step) => this.calls.step((place + step + others.length) % others.length);
    const button = (text, label, step) => {
      const made = element("button", { type: "button", "aria-label": label }, text);
      made.addEventListener("click", () => to(step));
      return made;
    };
    return element("div", { class: "steps" }, button("◀", "Previous link of this street", -1),
      `link ${place + 1} of ${others.length}`, button("▶", "Next link of this street", 1));
  }

  attributes(link) {
    const { links } = this.run;
    return Details.list([
      ["link", links.ids[link]],
      ["from, to node", `${links.nodes[links.from[link]]}, ${links.nodes[links.to[link]]}`],
      ["class", links.classes[links.class[link]] || "–"],
      ["length, lanes", `${told(links.length[link])} m, ${told(links.lanes[link], 1)}`],
      ["free speed", `${told(links.free_kmh[link])} km/h`],
      ["capacity", `${told(links.capacity_vph[link])} veh/h`],
      ["whole run", `${told(links.volume[link])} vehicles`],
    ]);
  }

  mark(bin) {
    if (this.link === null) return;
    this.charts.forEach((chart) => chart.mark(bin));
    this.now.replaceChildren(...Details.list(this.run.figures(this.link, bin)).childNodes);
  }

  static list(rows) {
    const list = element("dl", { class: "figures" });
    for (const [name, value] of rows) list.append(element("dt", {}, name), element("dd", {}, value));
    return list;
  }
}

/** Names and values of a link in a time step. */
Run.prototype.figures = function figures(link, bin) {
  const ratio = this.speedRatio(link, bin);
  return [
    ["speed", ratio === null ? "no vehicles"
      : `${told(this.speed(link, bin), 1)} km/h, ${told(100 * ratio)} % of free`],
    ["volume", `${told(this.volume(link, bin))} veh/h`],
    ["density", `${told(this.density(link, bin), 1)} veh/km`],
    ["time lost", `${told(this.delay(link, bin), 1)} veh·min`],
    ["queue", `${told(this.queue(link, bin))} m`],
  ];
};

/** The box beside the pointer. */
class HoverBox {
  constructor(run, box) {
    this.run = run;
    this.box = box;
  }

  show(link, point, bin) {
    this.box.hidden = link === null;
    if (link === null) return;
    const { links } = this.run;
    this.box.replaceChildren(
      element("strong", {}, this.run.name(link)),
      `link ${links.ids[link]}`,
      Details.list(this.run.figures(link, bin)),
    );
    const frame = this.box.parentElement.getBoundingClientRect();
    const { width, height } = this.box.getBoundingClientRect();
    const left = point.x + 16 + width > frame.width ? point.x - width - 12 : point.x + 16;
    const top = Math.min(point.y + 12, frame.height - height - 4);
    this.box.style.left = `${Math.max(left, 2)}px`;
    this.box.style.top = `${Math.max(top, 2)}px`;
  }
}
