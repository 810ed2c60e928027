"use strict";
// The scene of a run in space and time, drawn by WebGL. Arrays come packed in the page; texts go into
// the page as text alone, so that no name of a street is ever read as markup.

const TEXTS = JSON.parse(document.getElementById("texts").textContent);
const TYPES = { int16: Int16Array, uint16: Uint16Array, uint8: Uint8Array, int32: Int32Array, float32: Float32Array };
const CAMERAS = { south: [-71, 35], east: [19, 35], north: [109, 35], west: [199, 35], above: [-90, 89] };
const byId = (id) => document.getElementById(id);

async function unpacked() {
  const bytes = Uint8Array.from(atob(byId("arrays").textContent.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(stream).arrayBuffer();
  const arrays = {};
  for (const [name, { at, count, type }] of Object.entries(TEXTS.arrays))
    arrays[name] = new TYPES[type](buffer, at, count);
  return arrays;
}

// ---- vectors and matrices (column by column, as WebGL takes them)
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((x) => x / n); };
function product(a, b) {
  const c = new Float32Array(16);
  for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++)
    for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}

const VERTEX = `#version 300 es
layout(location = 0) in vec3 place; layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour; layout(location = 3) in float number;
uniform mat4 see; uniform vec3 light; uniform bool naming; uniform float raised;
out vec4 shade; out float height;
void main() {
  gl_Position = see * vec4(place + vec3(0.0, 0.0, raised), 1.0);
  float lit = dot(normal, normal) > 0.1 ? min(0.62 + 0.5 * max(dot(normal, light), 0.0), 1.0) : 1.0;
  int n = int(number);
  shade = naming ? vec4(float(n & 255), float((n >> 8) & 255), float((n >> 16) & 255), 255.0) / 255.0
    : vec4(colour.rgb * lit, colour.a);
  height = place.z;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec4 shade; in float height; uniform float until; out vec4 pixel;
void main() { if (height > until) discard; pixel = shade; }`;

function program(gl) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  return made;
}

// A batch of triangles or lines: places, normals, colours (0 to 255) and numbers (0: none) per point.
function batch(gl, mode, { places, normals, colours, numbers }) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  const count = places.length / 3;
  const give = (at, data, size, type, scaled) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, type, scaled, 0, 0);
  };
  give(0, places, 3, gl.FLOAT, false);
  give(1, normals || new Float32Array(3 * count), 3, gl.FLOAT, false);
  give(2, colours, 4, gl.UNSIGNED_BYTE, true);
  give(3, numbers || new Float32Array(count), 1, gl.FLOAT, false);
  return { mode, array, count };
}

const point = (arrays, name, row) => [0, 1, 2].map((k) => arrays[`${name}.points`][3 * row + k] / TEXTS.unit);

// Quads of a mesh as triangles. Every face is of the box that it is a sixth of: its number names it.
function quads(gl, arrays, name, first) {
  const faces = arrays[`${name}.faces`], rgb = arrays[`${name}.rgb`], count = faces.length / 4;
  const places = new Float32Array(18 * count), normals = new Float32Array(18 * count);
  const colours = new Uint8Array(24 * count), numbers = new Float32Array(6 * count);
  for (let f = 0; f < count; f++) {
    const p = [0, 1, 2, 3].map((k) => point(arrays, name, faces[4 * f + k]));
    const normal = unit(cross(sub(p[1], p[0]), sub(p[3], p[0])));
    [0, 1, 2, 0, 2, 3].forEach((k, v) => {
      places.set(p[k], 18 * f + 3 * v);
      normals.set(normal, 18 * f + 3 * v);
      colours.set([rgb[3 * f], rgb[3 * f + 1], rgb[3 * f + 2], 255], 24 * f + 4 * v);
      numbers[6 * f + v] = first + Math.floor(f / 6) + 1;
    });
  }
  return batch(gl, gl.TRIANGLES, { places, normals, colours, numbers });
}

function lines(gl, arrays, name, alpha) {
  const rows = arrays[`${name}.lines`], rgb = arrays[`${name}.rgb`];
  const places = new Float32Array(3 * rows.length), colours = new Uint8Array(4 * rows.length);
  for (let v = 0; v < rows.length; v++) {
    places.set(point(arrays, name, rows[v]), 3 * v);
    const c = 3 * (v >> 1);
    colours.set([rgb[c], rgb[c + 1], rgb[c + 2], alpha], 4 * v);
  }
  return batch(gl, gl.LINES, { places, colours });
}

// Lines on the ground as flat bands: WebGL draws lines one pixel wide.
function bands(gl, arrays, name, half) {
  const rows = arrays[`${name}.lines`], rgb = arrays[`${name}.rgb`], places = [], colours = [];
  for (let f = 0; f < rows.length / 2; f++) {
    const a = point(arrays, name, rows[2 * f]), b = point(arrays, name, rows[2 * f + 1]);
    const [x, y] = unit(sub(b, a)), n = [-y * half, x * half];
    const at = (p, s) => [p[0] + s * n[0], p[1] + s * n[1], p[2] + 0.0004];
    for (const corner of [at(a, 1), at(a, -1), at(b, -1), at(a, 1), at(b, -1), at(b, 1)]) {
      places.push(...corner);
      colours.push(rgb[3 * f], rgb[3 * f + 1], rgb[3 * f + 2], 255);
    }
  }
  return batch(gl, gl.TRIANGLES, { places: new Float32Array(places), colours: new Uint8Array(colours) });
}

function segments(gl, list, rgba) {
  const places = new Float32Array(list.flat(2));
  const colours = new Uint8Array((places.length / 3) * 4).map((_, k) => rgba[k % 4]);
  return batch(gl, gl.LINES, { places, colours });
}

function sheet(gl, height, rgba) {
  const [x0, y0, x1, y1] = TEXTS.ground, z = height;
  const places = new Float32Array([x0, y0, z, x1, y0, z, x1, y1, z, x0, y0, z, x1, y1, z, x0, y1, z]);
  return batch(gl, gl.TRIANGLES, { places, colours: new Uint8Array(24).map((_, k) => rgba[k % 4]) });
}

class Scene {
  constructor(canvas, arrays) {
    this.canvas = canvas;
    this.arrays = arrays;
    this.until = TEXTS.height * 1.001;
    const gl = (this.gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true }));
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.program = program(gl);
    gl.useProgram(this.program);
    this.uniform = Object.fromEntries(
      ["see", "light", "naming", "until", "raised"].map((name) => [name, gl.getUniformLocation(this.program, name)]));
    this.ground = sheet(gl, -0.002, [140, 140, 130, 26]);
    this.plane = sheet(gl, 0, [91, 127, 166, 70]);
    this.map = [lines(gl, arrays, "minor", 150), lines(gl, arrays, "major", 255), bands(gl, arrays, "slow", 0.0022)];
    this.walls = [quads(gl, arrays, "ribbons", 0), quads(gl, arrays, "queues", TEXTS.boxes)];
    this.ways = lines(gl, arrays, "trajectories", 120);
    const poles = TEXTS.marks.map((p) => [[p[0], p[1], 0], p]);
    this.still = [segments(gl, TEXTS.feet, [120, 120, 120, 90]), segments(gl, poles, [120, 120, 120, 255])];
    this.sides = TEXTS.axes.map((axis) => segments(gl, axis.side, [154, 160, 171, 200]));
    this.axes = TEXTS.axes.map((axis) => segments(gl, axis.segments, [128, 128, 128, 255]));
    this.target = gl.createFramebuffer();
    this.look(TEXTS.first);
  }

  look(name) {
    [this.azimuth, this.elevation] = CAMERAS[name];
    this.focus = [0, 0, 0.22 * TEXTS.height];
    const aspect = this.canvas.clientWidth / this.canvas.clientHeight || 1;
    this.distance = 2.55 * Math.max(1, 1.35 / aspect);
    this.draw();
  }

  direction() {
    const a = (this.azimuth * Math.PI) / 180, e = (this.elevation * Math.PI) / 180;
    return [Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e)];
  }

  matrix() {
    const back = this.direction(), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
    this.right = right;
    this.up = up;
    const eye = this.focus.map((x, k) => x + this.distance * back[k]);
    const view = [right, up, back].reduce((m, axis, i) => {
      axis.forEach((x, j) => { m[4 * j + i] = x; });
      m[12 + i] = -dot(axis, eye);
      return m;
    }, new Float32Array(16));
    view[15] = 1;
    const f = 1 / Math.tan((15 * Math.PI) / 180), near = 0.01 * this.distance, far = this.distance + 5;
    const aspect = this.canvas.width / this.canvas.height, lens = new Float32Array(16);
    lens[0] = f / aspect; lens[5] = f; lens[10] = (far + near) / (near - far); lens[11] = -1;
    lens[14] = (2 * far * near) / (near - far);
    return product(lens, view);
  }

  show(batch_, until = 1e9, raised = 0) {
    const gl = this.gl;
    if (!batch_.count) return;
    gl.uniform1f(this.uniform.until, until);
    gl.uniform1f(this.uniform.raised, raised);
    gl.bindVertexArray(batch_.array);
    gl.drawArrays(batch_.mode, 0, batch_.count);
  }

  begin(naming) {
    const gl = this.gl, canvas = this.canvas, ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.see = this.matrix();
    gl.uniformMatrix4fv(this.uniform.see, false, this.see);
    const back = this.direction();
    gl.uniform3fv(this.uniform.light, unit(back.map((x, k) => x - 0.6 * this.right[k] + 0.4 * this.up[k])));
    gl.uniform1i(this.uniform.naming, naming);
  }

  left() {
    const along = TEXTS.corners.map((c) => c[0] * this.right[0] + c[1] * this.right[1]);
    return along.indexOf(Math.min(...along));
  }

  draw() {
    const gl = this.gl, whole = this.until >= TEXTS.height;
    this.begin(false);
    gl.disable(gl.BLEND);
    this.walls.forEach((wall) => this.show(wall, this.until));
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.show(this.ground);
    [...this.map, ...this.still].forEach((one) => this.show(one));
    this.show(this.ways, this.until);
    const back = this.direction(), corners = TEXTS.corners;
    this.sides.forEach((side, k) => {
      const [a, b] = [corners[k], corners[(k + 1) % 4]];
      if ((b[1] - a[1]) * back[0] - (b[0] - a[0]) * back[1] < 0) this.show(side);
    });
    this.show(this.axes[this.left()]);
    if (!whole) this.show(this.plane, 1e9, this.until);
    this.label();
    document.documentElement.dataset.drawn = String(1 + Number(document.documentElement.dataset.drawn || 0));
  }

  label() {
    const wanted = [];
    const axis = TEXTS.axes[this.left()];
    axis.points.forEach((p, k) => wanted.push([p, axis.texts[k], ""]));
    TEXTS.marks.forEach((p, k) => wanted.push([p, String(k + 1), "mark"]));
    byId("labels").replaceChildren(...wanted.map(([p, text, kind]) => {
      const span = document.createElement("span");
      const m = this.see, w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
      const [x, y] = [0, 1].map((i) => (m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]) / w);
      span.textContent = text;
      span.className = kind;
      span.style.left = `${(50 * (1 + x)).toFixed(2)}%`;
      span.style.top = `${(50 * (1 - y)).toFixed(2)}%`;
      return span;
    }));
  }

  // Which wall is at a place of the canvas (CSS pixels from its corner): 0 is none.
  wallAt(x, y) {
    const gl = this.gl, ratio = this.canvas.width / this.canvas.clientWidth;
    const place = [Math.round(x * ratio), this.canvas.height - 1 - Math.round(y * ratio)];
    const texture = gl.createTexture(), depth = gl.createRenderbuffer();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, this.canvas.width, this.canvas.height);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, this.canvas.width, this.canvas.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...place, 1, 1);
    this.begin(true);
    gl.disable(gl.BLEND);
    this.walls.forEach((wall) => this.show(wall, this.until));
    const pixel = new Uint8Array(4);
    gl.readPixels(...place, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteTexture(texture);
    gl.deleteRenderbuffer(depth);
    return pixel[0] + 256 * pixel[1] + 65536 * pixel[2];
  }

  // What a wall says: its link, and the worst of its bins.
  describe(number) {
    const a = this.arrays, link = a["walls.link"][number - 1], first = a["walls.first"][number - 1];
    const last = a["walls.last"][number - 1], bins = TEXTS.clock.length - 1;
    const of = (name, pick) => pick(...a[name].subarray(link * bins + first, link * bins + last + 1));
    return [
      TEXTS.names[link],
      `${TEXTS.clock[first]}–${TEXTS.clock[last + 1]}`,
      `slowest ${of("links.speed", Math.min)} km/h (free ${a["links.free"][link]} km/h)`,
      `up to ${of("links.density", Math.max)} veh/km per lane`,
      `queue up to ${of("links.queue", Math.max)} m`,
    ].join("\n");
  }
}

function explain() {
  byId("scale_title").textContent = TEXTS.scale_title;
  byId("subtitle").textContent = TEXTS.subtitle;
  byId("heading").textContent = TEXTS.notes[0] || "Nobody was slow";
  byId("bar").replaceChildren(...TEXTS.scale_rgb.map((rgb) => {
    const box = document.createElement("div");
    box.style.background = `rgb(${rgb.join(",")})`;
    return box;
  }));
  byId("figures").replaceChildren(...TEXTS.scale_labels.map((label) => {
    const span = document.createElement("span");
    span.textContent = label;
    return span;
  }));
}

function listPlaces(scene) {
  byId("notes").replaceChildren(...TEXTS.notes.slice(1).map((note, k) => {
    const item = document.createElement("li"), button = document.createElement("button");
    button.textContent = note.replace(/^\d+\s+/, "");
    button.title = "look there";
    button.onclick = () => {
      const [x, y] = TEXTS.marks[k];
      scene.focus = [x, y, 0.5 * TEXTS.height];
      scene.distance = 1.3;
      scene.draw();
    };
    item.append(button);
    return item;
  }));
}

function addTime(scene) {
  const slider = byId("time"), play = byId("play");
  let timer = null;
  const set = (value) => {
    slider.value = value;
    const share = slider.value / slider.max;
    scene.until = share >= 1 ? TEXTS.height * 1.001 : share * TEXTS.height;
    const bin = Math.min(Math.round(share * (TEXTS.times.length - 1)), TEXTS.times.length - 1);
    byId("clock").textContent = TEXTS.times[bin];
    slider.setAttribute("aria-valuetext", TEXTS.times[bin]);
    scene.draw();
  };
  const stop = () => {
    clearInterval(timer);
    timer = null;
    play.textContent = "Play";
    play.setAttribute("aria-pressed", "false");
  };
  const toggle = () => {
    if (timer) return stop();
    if (Number(slider.value) >= Number(slider.max)) set(0);
    play.textContent = "Stop";
    play.setAttribute("aria-pressed", "true");
    timer = setInterval(() => {
      set(Number(slider.value) + Number(slider.max) / 100);
      if (Number(slider.value) >= Number(slider.max)) stop();
    }, 100);
  };
  slider.oninput = () => set(slider.value);
  play.onclick = toggle;
  set(slider.max);
  return toggle;
}

function addCameras(scene) {
  byId("cameras").replaceChildren(...Object.keys(CAMERAS).map((name) => {
    const button = document.createElement("button");
    button.className = "plain";
    button.textContent = name === "above" ? name : `from ${name}`;
    button.onclick = () => scene.look(name);
    return button;
  }));
}

function addPointer(scene) {
  const canvas = scene.canvas, held = new Map(), tip = byId("tip");
  let waiting = null;
  const turn = (dx, dy) => {
    scene.azimuth -= 0.35 * dx;
    scene.elevation = Math.min(89, Math.max(4, scene.elevation + 0.35 * dy));
  };
  const move = (dx, dy) => {
    const step = (0.54 * scene.distance) / canvas.clientHeight;
    scene.focus = scene.focus.map((x, k) => x - step * dx * scene.right[k] + step * dy * scene.up[k]);
  };
  const zoom = (factor) => { scene.distance = Math.min(8, Math.max(0.1, scene.distance * factor)); };
  canvas.onpointerdown = (e) => { held.set(e.pointerId, e); canvas.setPointerCapture(e.pointerId); };
  canvas.onpointerup = canvas.onpointercancel = (e) => {
    held.delete(e.pointerId);
    if (e.pointerType === "touch" && tip.style.display === "none") hint(e);
  };
  canvas.onpointermove = (e) => {
    clearTimeout(waiting);
    tip.style.display = "none";
    const before = held.get(e.pointerId);
    if (!before) {
      waiting = setTimeout(() => hint(e), 80);
      return;
    }
    const [dx, dy] = [e.clientX - before.clientX, e.clientY - before.clientY];
    const other = [...held.values()].find((one) => one.pointerId !== e.pointerId);
    if (other) {
      const gap = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
      zoom(gap(before) / gap(e));
      move(dx / 2, dy / 2);
    } else if (e.shiftKey || e.buttons & 6) move(dx, dy);
    else turn(dx, dy);
    held.set(e.pointerId, e);
    requestAnimationFrame(() => scene.draw());
  };
  const hint = (e) => {
    const number = scene.wallAt(e.offsetX, e.offsetY);
    if (!number) return;
    tip.textContent = scene.describe(number);
    tip.style.display = "block";
    tip.style.left = `${Math.min(e.clientX + 14, window.innerWidth - 270)}px`;
    tip.style.top = `${Math.min(e.clientY + 14, window.innerHeight - 130)}px`;
  };
  canvas.oncontextmenu = (e) => e.preventDefault();
  canvas.onwheel = (e) => { e.preventDefault(); zoom(Math.exp(0.001 * e.deltaY)); scene.draw(); };
  return { turn, zoom };
}

function addKeys(scene, { turn, zoom }, toggle) {
  const keys = {
    ArrowLeft: () => turn(-15, 0), ArrowRight: () => turn(15, 0), ArrowUp: () => turn(0, 10),
    ArrowDown: () => turn(0, -10), "+": () => zoom(0.9), "-": () => zoom(1.1), " ": toggle,
  };
  scene.canvas.onkeydown = (e) => {
    if (!keys[e.key]) return;
    e.preventDefault();
    keys[e.key]();
    scene.draw();
  };
}

unpacked().then((arrays) => {
  explain();
  const scene = new Scene(byId("scene"), arrays);
  window.scene = scene;
  listPlaces(scene);
  addCameras(scene);
  addKeys(scene, addPointer(scene), addTime(scene));
  window.onresize = () => scene.draw();
  document.documentElement.dataset.ready = "true";
}).catch((error) => {
  byId("heading").textContent = `The scene cannot be drawn: ${error.message}`;
  document.documentElement.dataset.ready = "failed";
});
