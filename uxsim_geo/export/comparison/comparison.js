"use strict";
// The page of a study: scenario, quantity, time, search, keys and print, tied together.

const WHOLE_RUN = -1;

class ComparisonPage extends MapPage {
  constructor(run) {
    super();
    this.run = run;
    this.bin = WHOLE_RUN;
    this.hovered = null;
    this.link = null;
    this.hover = new HoverBox(run, byId("hover"));
    this.addChoices();
    this.addTime();
    this.addSearch();
    for (const block of document.querySelectorAll(".block")) block.addEventListener("click", (event) => {
      const button = event.target.closest("[data-link]");
      if (button) this.showFound([this.run.links.ids.indexOf(button.dataset.link)], "");
      if (button) byId("map").scrollIntoView({ block: "nearest" });
    });
  }

  async addMap() {
    this.map = new DifferenceMap(this.run, "map", {
      hover: (link, point) => this.pointAt(link, point),
      choose: (link) => link !== null && this.choose(link),
      zone: () => {},
      worst: () => {},
      redraw: () => this.draw(),
      trouble,
    });
    await this.map.ready;
    this.map.map.fitBounds(this.run.content.view, { padding: 34, animate: false });
    this.map.mark();
    this.addTilesAndPrint();
  }

  /** Draw on the map what is chosen; says whether that changes anything. */
  showMap() {
    return this.map.show(this.bin, byId("sure").checked);
  }

  addChoices() {
    const { content } = this.run;
    content.quantities.slice(0, content.count).forEach((quantity, number) => {
      const input = element("input", { type: "radio", name: "quantity", value: quantity.key });
      input.checked = number === this.run.quantity;
      input.addEventListener("change", () => {
        this.run.quantity = number;
        this.drawDetails();
        this.draw();
      });
      byId("quantities").append(element("label", {}, input, ` ${quantity.label}`));
    });
    byId("relative").addEventListener("change", (event) => {
      this.run.relative = event.target.checked;
      this.draw();
    });
    byId("sure").addEventListener("change", () => this.draw());
    byId("scenario").addEventListener("change", (event) => this.take(Number(event.target.value)));
  }

  /** Show another scenario, and its tables alone. */
  async take(scenario) {
    await this.run.take(scenario);
    for (const block of document.querySelectorAll(".block")) {
      block.hidden = Number(block.dataset.scenario) !== scenario;
    }
    this.map?.mark();
    this.drawDetails();
    await this.draw();
  }

  addTime() {
    const { content, bins } = this.run;
    byId("time").hidden = !content.has_time;
    byId("no-time").hidden = content.has_time;
    const slider = byId("slider");
    slider.max = bins;  // 0 is the whole run
    slider.addEventListener("input", () => this.goTo(Number(slider.value) - 1));
    byId("all-time").addEventListener("click", () => this.goTo(WHOLE_RUN));
    byId("back").addEventListener("click", () => this.goTo(this.bin - 1));
    byId("forth").addEventListener("click", () => this.goTo(this.bin + 1));
    document.addEventListener("keydown", (event) => this.key(event));
  }

  /** Arrow keys for time, unless what has the focus uses them itself. */
  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const where = event.target instanceof Element ? event.target : document.body;
    const steps = { ArrowLeft: -1, ArrowRight: 1 };
    if (steps[event.key] && !where.closest("input, select, #map")) {
      event.preventDefault();
      this.goTo(this.bin + steps[event.key]);
    }
  }

  /** Show a time step; the promise is kept when the map has drawn it. */
  goTo(bin) {
    const last = this.run.content.has_time ? this.run.bins - 1 : WHOLE_RUN;
    this.bin = Math.min(Math.max(bin, WHOLE_RUN), last);
    return this.draw();
  }

  async draw() {
    const { run } = this;
    const slider = byId("slider");
    slider.value = this.bin + 1;
    slider.setAttribute("aria-valuetext", run.span(this.bin));
    byId("clock").textContent = run.span(this.bin);
    byId("all-time").setAttribute("aria-pressed", String(this.bin < 0));
    this.drawLegend();
    this.markDetails();
    if (this.hovered) this.hover.show(this.hovered.link, this.hovered.point, this.bin);
    if (!this.map) return;
    const isChanged = this.showMap();
    if (isChanged || !this.map.map.loaded()) await new Promise((resolve) => this.map.map.once("idle", resolve));
    // for those who measure
    const shown = run.content.quantities[run.shown(this.bin)];
    document.documentElement.dataset.shown = `${run.scenario} ${shown.key}${shown.relative ? " relative" : ""} ${this.bin}`;
  }

  drawLegend() {
    const { run } = this;
    const { label, unit, labels, colours, colours_on_dark: onDark } = run.content.quantities[run.shown(this.bin)];
    const shown = this.map?.isDark ? onDark : colours;
    const list = element("ul");
    const add = (look, text) => list.append(element("li", {}, element("span", look), text));
    for (let index = 2 * SIDES; index >= 0; index--) add({ class: "swatch", style: `background: ${shown[index]}` }, labels[index]);
    const { kinds, changed } = run.content.scenarios[run.scenario];
    if (changed.length) add({ class: "swatch edited" }, "edited by the scenario");
    if (kinds.includes(ONLY_BASE)) add({ class: "swatch dashed" }, labels[REMOVED_CLASS]);
    if (kinds.includes(ONLY_SCENARIO)) add({ class: "swatch", style: `background: ${shown[ADDED_CLASS]}` }, labels[ADDED_CLASS]);
    add({ class: "swatch", style: `background: ${shown[UNKNOWN_CLASS]}; height: 0.2rem` }, labels[UNKNOWN_CLASS]);
    const isKnown = run.content.scenarios[run.scenario].seeds > 1;
    const pale = !isKnown ? "One pair of runs: how sure a change is, is not known."
      : this.bin < 0 ? "Pale: may be chance (of the others 5 % at most are)." : "Pale: the 95 % interval holds 0.";
    byId("legend").replaceChildren(element("b", {}, `Change of ${label.toLowerCase()}, ${unit}`), list,
      element("span", { class: "quiet" }, `${pale} The wider, the larger the change.`
        + ` Links lie to the ${run.content.map.left ? "left" : "right"} of their direction.`));
  }

  /** Show a link's details, outlined with others of its street. */
  choose(link, street = [link]) {
    this.link = link;
    this.map?.outline(street);
    this.drawDetails();
  }

  drawDetails() {
    const { run, link } = this;
    if (link === null) return;
    const panel = byId("details");
    this.figures = element("div");
    const charts = element("div", { class: "link-charts" });
    panel.replaceChildren(element("h3", {}, run.name(link)), element("p", { class: "quiet" }, `link ${run.links.ids[link]}, `
      + `${told(run.links.length[link])} m, lanes: ${told(run.links.lanes[link], 1)}`), this.figures, charts);
    this.charts = run.content.has_time ? this.curves(charts, link) : [];
    this.markDetails();
  }

  /** Base and scenario over time, a chart a quantity. */
  curves(box, link) {
    const { run } = this;
    const steps = Array.from({ length: run.bins }, (_, bin) => bin);
    return steps.length < 2 ? [] : Array.from({ length: run.content.count }, (_, quantity) => {
      const of = (side) => steps.map((bin) => run.number(side, link, bin, quantity));
      const { title, unit } = run.content.quantities[2 * run.content.count + quantity];
      const series = [{ label: "base", values: of("base"), digits: 2 }, { label: "scenario", values: of("scenario"), digits: 2 }];
      return new TimeChart(box, run, title, series, { go: (bin) => this.goTo(bin), box: SMALL_CHART, unit });
    });
  }

  markDetails() {
    if (this.link === null || !this.figures) return;
    this.figures.replaceChildren(element("p", { class: "quiet" }, this.run.span(this.bin)),
      Details.list(this.run.figures(this.link, this.bin)));
    for (const chart of this.charts) chart.mark(Math.max(this.bin, 0));
  }

  /** Show the street or link of that name, else a street with it in its name; say what it is. */
  find(wanted) {
    const { names, ids } = this.run.links;
    const same = (one) => one.toLowerCase() === wanted;
    const name = names.findIndex(same);
    if (name >= 0) return this.findStreet(name);
    const link = ids.findIndex(same);
    if (link >= 0) return this.showFound([link], `link ${ids[link]}`);
    const like = names.findIndex((one) => one.toLowerCase().includes(wanted));
    return like >= 0 ? this.findStreet(like) : "No street or link is called so.";
  }

  /** All links of a street, the one whose shown quantity changes most first. */
  findStreet(name) {
    const found = [];
    this.run.links.name.forEach((one, link) => one === name && found.push(link));
    const size = (link) => Math.abs(this.run.change(link, this.bin) ?? 0);
    found.sort((a, b) => size(b) - size(a));
    const words = found.length > 1 ? `${told(found.length)} links, the one that changes most first`
      : `link ${this.run.links.ids[found[0]]}`;
    return this.showFound(found, `${this.run.links.names[name]}: ${words}`);
  }
}

openPage(async () => {
  const page = new ComparisonPage(await Differences.load());
  window.trafficComparison = page;  // for the browser's console
  await page.take(0);
  return page;
}, "Tables are complete.");
