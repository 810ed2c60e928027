"use strict";
// Trips between zones: a zone's largest flows as a table and as arcs on the map.

const MOST_ARCS = 30;
const MOST_ROWS = 15;

class Trips {
  /** map comes later, if the browser can draw one. */
  constructor(run, panel) {
    this.run = run;
    this.zones = run.content.zones;
    this.map = null;
    this.marks = [];
    const count = this.zones.names.length;
    this.from = new Float64Array(count);
    this.to = new Float64Array(count);
    this.zones.origin.forEach((origin, pair) => {
      this.from[origin] += this.zones.vehicles[pair];
      this.to[this.zones.destination[pair]] += this.zones.vehicles[pair];
    });
    this.build(panel);
  }

  build(panel) {
    const { names, kind, pairs, origin } = this.zones;
    if (!names.length) {
      panel.append("Nobody wanted to travel.");
      return;
    }
    const busiest = names.map((_, zone) => zone).sort((a, b) => this.from[b] - this.from[a] || this.to[b] - this.to[a]);
    this.select = element("select", { id: "zone" });
    for (const zone of busiest) this.select.append(element("option", { value: zone }, names[zone]));
    this.direction = element("select", { id: "direction" },
      element("option", { value: "from" }, "trips from there"), element("option", { value: "to" }, "trips to there"));
    this.check = element("input", { type: "checkbox", id: "trips-on-map" });
    const note = `Zones are ${kind}; those where most trips start stand first.`
      + (pairs > origin.length ? ` The largest ${told(origin.length)} of ${told(pairs)} pairs are here.` : "");
    panel.append(element("div", { class: "choice" },
      element("label", { for: "zone" }, "Zone"), this.select,
      element("label", { for: "direction" }, "Direction"), this.direction,
      element("label", {}, this.check, " show on the map"),
      element("p", { class: "quiet" }, note)));
    this.table = element("div", { class: "wide" });
    panel.append(this.table);
    for (const input of [this.select, this.direction, this.check]) {
      input.addEventListener("change", () => this.update());
    }
    this.fill();
  }

  choose(zone, onMap = false) {
    this.select.value = zone;
    if (onMap) this.check.checked = true;
    // a zone that only receives trips shows those
    const sums = { from: this.from[zone], to: this.to[zone] };
    if (!sums[this.direction.value]) this.direction.value = sums.from ? "from" : "to";
    this.update();
  }

  /** Pairs of the chosen zone, the largest first: {zone, vehicles, delay}. */
  pairs() {
    const { origin, destination, vehicles, delay_min: delay } = this.zones;
    const zone = Number(this.select.value);
    const [here, there] = this.direction.value === "from" ? [origin, destination] : [destination, origin];
    const found = [];
    here.forEach((one, pair) => {
      if (one === zone) found.push({ zone: there[pair], vehicles: vehicles[pair], delay: delay[pair] });
    });
    return found.sort((a, b) => b.vehicles - a.vehicles);
  }

  fill() {
    const pairs = this.pairs();
    const isFrom = this.direction.value === "from";
    const zone = Number(this.select.value);
    const total = isFrom ? this.from[zone] : this.to[zone];
    const head = element("tr");
    for (const [text, kind] of [[isFrom ? "to" : "from", ""], ["vehicles", "number"], ["", ""], ["mean delay, min", "number"]]) {
      head.append(element("th", { scope: "col", class: kind }, text));
    }
    const body = element("tbody");
    for (const pair of pairs.slice(0, MOST_ROWS)) {
      const bar = element("span", { class: "bar", style: `width: ${(100 * pair.vehicles) / pairs[0].vehicles}%` });
      body.append(element("tr", {}, element("th", { scope: "row" }, this.zones.names[pair.zone]),
        element("td", { class: "number" }, told(pair.vehicles)), element("td", { style: "width: 40%" }, bar),
        element("td", { class: "number" }, pair.delay < 0.05 ? "none" : told(pair.delay, 1, 1))));
    }
    const rest = pairs.length > MOST_ROWS ? `, the ${MOST_ROWS} largest of ${told(pairs.length)} pairs` : "";
    const words = `${told(total)} vehicles ${this.direction.value} ${this.zones.names[zone]}${rest}`;
    this.table.replaceChildren(element("table", {}, element("caption", {}, words), element("thead", {}, head), body));
  }

  update() {
    this.fill();
    for (const mark of this.marks) mark.remove();
    this.marks = [];
    if (!this.map) return;
    if (!this.check.checked) {
      this.map.showTrips([], []);
      return;
    }
    const zone = Number(this.select.value);
    const pairs = this.pairs().filter((pair) => pair.zone !== zone).slice(0, MOST_ARCS);
    this.map.showTrips(this.circles(), pairs.map((pair) => this.arc(zone, pair, pairs[0].vehicles)));
    for (const one of [zone, ...pairs.slice(0, MOST_ROWS).map((pair) => pair.zone)]) {
      const mark = element("div", { class: "zone-mark" }, this.zones.names[one]);
      this.marks.push(new maplibregl.Marker({ element: mark }).setLngLat(this.zones.points[one]).addTo(this.map.map));
    }
  }

  circles() {
    const most = Math.max(...this.from, ...this.to);
    const largest = this.zones.points.length > 100 ? 6 : 12;
    return this.zones.points.map((point, zone) => ({
      type: "Feature",
      properties: { zone, radius: 3 + largest * Math.sqrt((this.from[zone] + this.to[zone]) / (2 * most)) },
      geometry: { type: "Point", coordinates: point },
    }));
  }

  /** A bow to the right of its direction. */
  arc(zone, pair, most) {
    const ends = [this.zones.points[zone], this.zones.points[pair.zone]];
    const [a, b] = this.direction.value === "from" ? ends : ends.reverse();
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const control = [(a[0] + b[0]) / 2 + 0.24 * dy, (a[1] + b[1]) / 2 - 0.24 * dx];
    const line = [];
    for (let i = 0; i <= 20; i++) {
      const t = i / 20;
      line.push(a.map((value, axis) => (1 - t) ** 2 * value + 2 * t * (1 - t) * control[axis] + t ** 2 * b[axis]));
    }
    return {
      type: "Feature", properties: { width: 0.8 + (7 * pair.vehicles) / most },
      geometry: { type: "LineString", coordinates: line },
    };
  }
}
