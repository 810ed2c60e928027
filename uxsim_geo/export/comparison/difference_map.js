"use strict";
// The map of differences: the report's map with other colours, widths and opacities.

const PERHAPS = 0.3;  // opacity of what may be chance
const REMOVED_CLASS = 7, ADDED_CLASS = 8, UNKNOWN_CLASS = 9;

class DifferenceMap extends RoadMap {
  paints() {
    const paints = super.paints();
    paints.traffic["line-opacity"] = ["coalesce", ["feature-state", "opacity"], 1];
    paints.chosen["line-opacity"] = 0.3;  // it shows beside links that hardly change
    return paints;
  }

  addLayers() {
    super.addLayers();
    const empty = { type: "FeatureCollection", features: [] };
    const side = this.run.content.map.left ? -1 : 1;
    const offset = this.grown(side * (this.gap + this.wide / 2));
    for (const name of ["edited", "removed"]) this.map.addSource(name, { type: "geojson", data: empty });
    const line = (id, paint, before) => this.map.addLayer({ id, type: "line", source: id, paint: { "line-offset": offset, ...paint } }, before);
    // a frame, whatever the width of the link within
    line("edited", { "line-color": this.colour("ink"), "line-width": this.grown(1.3), "line-gap-width": this.grown(this.wide) });
    // gaps in the line of a removed link
    line("removed", { "line-color": this.colour("ground"), "line-width": this.grown(this.wide), "line-dasharray": [0.6, 0.9] });
    this.opacity = new Float32Array(this.run.lines.length).fill(1);
  }

  takeGround(isDark) {
    super.takeGround(isDark);
    this.map.setPaintProperty("edited", "line-color", this.colour("ink"));
    this.map.setPaintProperty("removed", "line-color", this.colour("ground"));
  }

  /** Marks of a scenario that do not change in time. */
  mark() {
    const { run } = this;
    const features = (wanted) => ({ type: "FeatureCollection", features: run.lines.flatMap((coordinates, link) => (
      wanted(link) ? [{ type: "Feature", properties: {}, geometry: { type: "LineString", coordinates } }] : [])) });
    const edited = new Set(run.content.scenarios[run.scenario].changed);
    this.map.getSource("edited").setData(features((link) => edited.has(link)));
    this.map.getSource("removed").setData(features((link) => run.kind(link) === ONLY_BASE));
  }

  /** Class, width in steps and opacity of a link. */
  look(link, bin, breaks, isSureAlone) {
    const { run } = this;
    const kind = run.kind(link);
    if (kind === ABSENT) return [-1, 0, 0];
    if (kind === ONLY_BASE) return [REMOVED_CLASS, WIDTHS, 1];
    if (kind === ONLY_SCENARIO) return [ADDED_CLASS, WIDTHS, 1];
    const value = run.change(link, bin);
    if (value === null) return [UNKNOWN_CLASS, 1, 0.6];
    const number = run.classOf(value, breaks);
    if (number === SIDES) return [number, 1, 1];
    const sure = run.isSure(link, bin);
    if (isSureAlone && sure === false) return [SIDES, 1, 1];
    const share = Math.sqrt(Math.min(Math.abs(value) / breaks[breaks.length - 1], 1));
    return [number, 1 + Math.round((WIDTHS - 1) * share), sure === false ? PERHAPS : 1];
  }

  /** Show the run's scenario and quantity in a time step, −1: the whole run; tells whether anything changed. */
  show(bin, isSureAlone) {
    const { run } = this;
    const number = run.shown(bin);
    const { breaks } = run.content.quantities[number];
    const palette = 2 * PALETTE * number + (this.isDark ? PALETTE : 0);
    let changed = 0;
    for (let link = 0; link < this.class.length; link++) {
      const [own, width, opacity] = this.look(link, bin, breaks, isSureAlone);
      const colour = own < 0 ? -1 : palette + own;
      if (colour === this.shownColour[link] && width === this.width[link] && opacity === this.opacity[link]) continue;
      changed += 1;
      this.shownColour[link] = colour;
      this.class[link] = own;
      this.width[link] = width;
      this.opacity[link] = opacity;
      const px = width ? 1 + this.narrow + ((this.wide - this.narrow - 1) * (width - 1)) / (WIDTHS - 1) : 0;
      this.map.setFeatureState({ source: "links", id: link }, { colour, width: px, opacity });
    }
    return changed > 0;
  }

  get shownColour() {
    this.colourKept ??= new Int16Array(this.run.lines.length).fill(-2);
    return this.colourKept;
  }
}
