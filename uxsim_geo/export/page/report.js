"use strict";
// The page itself: time, quantities, search, keys and print, tied together.

const PAUSE = 350;  // ms between two steps while playing, at least

class Page extends MapPage {
  constructor(run) {
    super();
    this.run = run;
    this.quantity = 0;
    this.bin = run.content.worst_bin;  // in which vehicles lose most time: where to begin looking
    this.hovered = null;
    this.street = [];
    this.isPlaying = false;
    const go = (bin) => this.goTo(bin);
    this.charts = networkCharts(byId("network-charts"), run, go);
    this.details = new Details(run, byId("details"), { go, step: (place) => this.choose(this.street[place], this.street) });
    this.hover = new HoverBox(run, byId("hover"));
    this.trips = new Trips(run, byId("trips-panel"));
    this.addQuantities();
    this.addSearch();
    this.addTime();
    byId("worst-table")?.addEventListener("click", (event) => {
      const button = event.target.closest("[data-worst]");
      if (button) this.showWorst(Number(button.dataset.worst));
    });
  }

  async addMap() {
    this.map = new RoadMap(this.run, "map", {
      hover: (link, point) => this.pointAt(link, point),
      choose: (link) => link !== null && this.choose(link, [link]),
      zone: (zone) => this.trips.choose(zone),
      worst: (number) => this.showWorst(number),
      redraw: () => this.draw(),
      trouble,
    });
    await this.map.ready;
    this.trips.map = this.map;
    byId("circles").checked = this.map.circles;
    byId("circles").addEventListener("change", (event) => {
      this.map.circles = event.target.checked;
      this.draw();
    });
    this.addTilesAndPrint();
  }

  /** Draw on the map what is chosen; says whether that changes anything. */
  showMap() {
    return this.map.show(this.quantity, this.bin);
  }

  addQuantities() {
    const box = byId("quantities");
    this.run.content.quantities.forEach((quantity, number) => {
      const input = element("input", { type: "radio", name: "quantity", value: quantity.key });
      input.checked = number === this.quantity;
      input.addEventListener("change", () => {
        this.quantity = number;
        this.draw();
      });
      box.append(element("label", {}, input, ` ${quantity.label}`));
    });
  }

  drawLegend() {
    const { label, unit, labels, colours, colours_on_dark: onDark } = this.run.content.quantities[this.quantity];
    const list = element("ul");
    const shown = this.map?.isDark ? onDark : colours;
    labels.forEach((text, index) => list.append(
      element("li", {}, element("span", { class: "swatch", style: `background: ${shown[index]}` }), text),
    ));
    list.append(element("li", {}, element("span", { class: "swatch", style: "background: var(--map-roads)" }), "no vehicles, or none of it"));
    if (this.map?.circles) list.append(element("li", {}, element("span", { class: "circle", style: `background: ${this.map.slowest()}` }),
      `time lost before a junction, at most ${told(this.map.mostLost)} vehicle-minutes`));
    byId("legend").replaceChildren(element("b", {}, `${label}, ${unit}`), list,
      element("span", { class: "quiet" }, "The wider, the more of the road is taken."
        + ` Links lie to the ${this.run.content.map.left ? "left" : "right"} of their direction.`));
  }

  addTime() {
    const slider = byId("slider");
    slider.max = this.run.bins - 1;
    slider.addEventListener("input", () => this.goTo(Number(slider.value)));
    byId("back").addEventListener("click", () => this.goTo(this.bin - 1));
    byId("forth").addEventListener("click", () => this.goTo(this.bin + 1));
    byId("play").addEventListener("click", () => this.play(!this.isPlaying));
    document.addEventListener("keydown", (event) => this.key(event));
  }

  /** Keys for time, unless what has the focus uses them itself. */
  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const where = event.target instanceof Element ? event.target : document.body;
    const steps = { ArrowLeft: -1, ArrowRight: 1 };
    if (event.key === " " && !where.closest("button, input, select, summary, a")) {
      event.preventDefault();
      this.play(!this.isPlaying);
    } else if (steps[event.key] && !where.closest("input, select, #map")) {
      event.preventDefault();
      this.goTo(this.bin + steps[event.key]);
    }
  }

  async play(wanted) {
    this.isPlaying = wanted;
    byId("play").textContent = wanted ? "⏸ Stop" : "▶ Play";
    byId("play").setAttribute("aria-pressed", String(wanted));
    while (this.isPlaying) {
      const step = this.goTo(this.bin + 1 < this.run.bins ? this.bin + 1 : 0);
      await Promise.all([step, new Promise((resolve) => setTimeout(resolve, PAUSE))]);
      if (this.bin === this.run.bins - 1) this.play(false);
    }
  }

  /** Show a time step; the promise is kept when the map has drawn it. */
  goTo(bin) {
    this.bin = Math.min(Math.max(bin, 0), this.run.bins - 1);
    return this.draw();
  }

  async draw() {
    const begun = performance.now();
    this.drawTime();
    this.drawLegend();
    if (!this.map) return;
    const isChanged = this.showMap();
    if (isChanged || !this.map.map.loaded()) await new Promise((resolve) => this.map.map.once("idle", resolve));
    // for those who measure
    document.documentElement.dataset.stepMs = (performance.now() - begun).toFixed(0);
    document.documentElement.dataset.shown = `${this.run.content.quantities[this.quantity].key} ${this.bin}`;
  }

  drawTime() {
    const span = this.run.span(this.bin);
    const slider = byId("slider");
    slider.value = this.bin;
    slider.setAttribute("aria-valuetext", span);
    byId("clock").textContent = span;
    this.charts.forEach((chart) => chart.mark(this.bin));
    this.details.mark(this.bin);
    if (this.hovered) this.hover.show(this.hovered.link, this.hovered.point, this.bin);
  }

  /** Show a link's details; street are the links that are outlined with it. */
  choose(link, street) {
    this.street = street;
    this.details.show(link, street, this.bin);
    this.map?.outline(street.length > 1 ? [...street, link] : [link]);
  }

  /** No link, as when the page was opened. */
  chooseNone() {
    this.street = [];
    this.details.clear();
    this.map?.outline([]);
  }

  /** All links of a street, the one that loses most time in this step first. */
  linksOf(name) {
    const found = [];
    this.run.links.name.forEach((one, link) => one === name && found.push(link));
    const lost = new Map(found.map((link) => [link, this.run.delay(link, this.bin)]));
    return found.sort((a, b) => lost.get(b) - lost.get(a));
  }

  showWorst(number) {
    const { link, bin } = this.run.content.worst[number];
    this.bin = bin;
    const street = this.linksOf(this.run.links.name[link]);
    this.choose(link, street);
    this.map?.goTo(street);
    this.draw();
    byId("map").scrollIntoView({ block: "nearest" });
  }

  /** Show the street, link or zone of that name, else a street with it in its name; say what it is. */
  find(wanted) {
    const { names, ids } = this.run.links;
    const zones = this.run.content.zones.names;
    const same = (one) => one.toLowerCase() === wanted;
    const name = names.findIndex(same);
    if (name >= 0) return this.findStreet(name);
    const link = ids.findIndex(same);
    if (link >= 0) return this.showFound([link], `link ${ids[link]}`);
    const zone = zones.findIndex((one) => same(one) || `zone ${one.toLowerCase()}` === wanted);
    if (zone >= 0) {
      this.trips.choose(zone, true);
      return `Zone ${zones[zone]}: its trips are on the map and in the table below.`;
    }
    const like = names.findIndex((one) => one.toLowerCase().includes(wanted));
    if (like >= 0) return this.findStreet(like);
    this.chooseNone();
    return "No street, link or zone is called so.";
  }

  findStreet(name) {
    const found = this.linksOf(name);
    const words = found.length > 1 ? `${told(found.length)} links, the one that loses most time now first`
      : `link ${this.run.links.ids[found[0]]}`;
    return this.showFound(found, `${this.run.links.names[name]}: ${words}`);
  }
}

openPage(async () => {
  const page = new Page(await Run.load());
  window.trafficReport = page;  // for the browser's console
  page.draw();
  return page;
}, "Curves and tables are complete.");
