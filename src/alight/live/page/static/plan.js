// <alight-plan>: arm, body and contact from above, to scale; below it the contact, magnified.

import { fixed, quantity } from "./format.js";
import { Contact } from "./contact.js";
import { axes, hatch, zigzag } from "./sketch.js";
import { fit, Painter, theme } from "./theme.js";
import { timeline } from "./timeline.js";

/** Only the face of the body is to scale: what lies behind it is not part of the model. [m] */
const PLATE = 0.006, STANDOFF = 0.016, DEPTH = 0.055, SPRING = 0.11;
/** Extent of the body along X2, from the height of the target: the tip may strike high. [m] */
const BELOW = 0.05, ABOVE = 0.14;
/** Length of the trail of the tip [s], and its points. */
const TRAIL = 2, POINTS = 500;
/** Least force that is drawn as an arrow [N], and that of which the arrow is longest. */
const FAINT = 0.05, STRONG = 500;
const LEFT = 38, BOTTOM = 30;

export class Plan extends HTMLElement {
  constructor() {
    super();
    this.attachShadow({ mode: "open" });
    const style = document.createElement("style");
    style.textContent = ":host { display: block; } canvas { display: block; }";
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "plan view of arm, body and contact");
    this.shadowRoot.append(style, this.canvas);
    this.time = timeline();
    this.bench = this.time.bench;
    this.contact = new Contact();
    this.painter = new Painter(() => this.draw());
  }

  connectedCallback() {
    const want = () => this.painter.want();
    this._stop = new AbortController();
    const { signal } = this._stop;
    this._observer = new ResizeObserver(want);
    this._observer.observe(this);
    for (const name of ["layout", "rows"]) this.bench.addEventListener(name, want, { signal });
    this.time.addEventListener("change", want, { signal });
    theme.addEventListener("change", want, { signal });
    want();
  }

  disconnectedCallback() {
    this._stop.abort();
    this._observer.disconnect();
  }

  /** Where everything is at a row. */
  pose(row) {
    const { bench } = this, { geometry: g } = bench.layout;
    const of = (name) => bench.value(name, row);
    const tip = [of("x_r1"), of("x_r2")], elbow = [of("elbow1"), of("elbow2")];
    return {
      row, tip, elbow, q1: of("q1"), q2: of("q2"), x_m: of("x_m"), gap: of("gap"), touch: of("Lambda") > 0,
      clearance: of("probe_clearance"), most: g.clearance, deflection: of("deflection"),
      x_rd: [of("x_rd1"), of("x_rd2")], F_m: of("F_m"), F_t: of("F_t"),
      x_md: bench.target(row),
    };
  }

  draw() {
    const width = this.clientWidth, height = this.clientHeight;
    if (width < 60 || height < 60) return;
    fit(this.canvas, width, height);
    const ctx = (this.ctx ??= this.canvas.getContext("2d", { alpha: false }));
    const ratio = window.devicePixelRatio || 1;
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.fillStyle = theme.ground;
    ctx.fillRect(0, 0, width, height);
    const { bench } = this;
    if (!bench.history?.started) return this._waiting(ctx, width, height);
    const pose = this.pose(this.time.shown);
    const [scene, inset] = divide(width, height);
    this._frame(scene);
    this._scene(ctx, scene, pose);
    this.contact.draw(ctx, inset, pose);
    this.posed = pose;
  }

  _waiting(ctx, width, height) {
    ctx.font = theme.font;
    ctx.fillStyle = theme.dim;
    ctx.textAlign = "center";
    ctx.fillText(this.bench.problem || "waiting for telemetry", width / 2, height / 2);
  }

  /** Scale and place of the plane in its box: base, reach of the approach, and wall in sight. */
  _frame(box) {
    const g = this.bench.layout.geometry;
    this.wall = g.x_0 + PLATE + STANDOFF + DEPTH + SPRING;
    const out = 0.3 * g.l1;
    const low = [Math.min(-out, g.start[0] - 0.04), -0.05];
    const high = [this.wall + 0.02, Math.max(g.x_rd2 + ABOVE + 0.06, g.start[1] + 0.05, g.l1 + 0.05)];
    const inner = { x: box.x + LEFT, y: box.y + 6, w: box.w - LEFT - 6, h: box.h - BOTTOM - 6 };
    const k = Math.min(inner.w / (high[0] - low[0]), inner.h / (high[1] - low[1]));
    // What is left over goes to both sides.
    const spare = [(inner.w / k - (high[0] - low[0])) / 2, (inner.h / k - (high[1] - low[1])) / 2];
    this.inner = inner;
    this.k = k;
    this.low = [low[0] - spare[0], low[1] - spare[1]];
    this.high = [high[0] + spare[0], high[1] + spare[1]];
  }

  _x(x1) {
    return this.inner.x + (x1 - this.low[0]) * this.k;
  }

  _y(x2) {
    return this.inner.y + this.inner.h - (x2 - this.low[1]) * this.k;
  }

  _scene(ctx, box, pose) {
    const { inner } = this;
    ctx.fillStyle = theme.plot;
    ctx.fillRect(inner.x, inner.y, inner.w, inner.h);
    axes(ctx, inner, this.low, this.high, this.k);
    ctx.save();
    ctx.beginPath();
    ctx.rect(inner.x, inner.y, inner.w, inner.h);
    ctx.clip();
    this._body(ctx, pose);
    this._trail(ctx, pose);
    this._arm(ctx, pose);
    this._targets(ctx, pose);
    this._force(ctx, pose);
    this._instant(ctx, pose);
    ctx.restore();
    ctx.strokeStyle = theme.border;
    ctx.lineWidth = 1;
    ctx.strokeRect(inner.x + 0.5, inner.y + 0.5, inner.w - 1, inner.h - 1);
  }

  /** What is not the present says so. */
  _instant(ctx, { row }) {
    const { time, inner } = this;
    if (!time.paused && time.hover === null && time.cursors[0] === null) return;
    ctx.font = theme.bold;
    ctx.fillStyle = theme.warn;
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.fillText(`at ${fixed(time.seconds(row), 4)} s`, inner.x + 5, inner.y + 30);
  }

  _body(ctx, { x_m, touch, deflection }) {
    const g = this.bench.layout.geometry, { k } = this;
    const top = this._y(g.x_rd2 + ABOVE), high = (BELOW + ABOVE) * k, middle = top + high / 2;
    const face = this._x(x_m + deflection), front = this._x(x_m + PLATE + STANDOFF), back = front + DEPTH * k, wall = this._x(this.wall);
    ctx.lineWidth = 1.2;
    ctx.strokeStyle = theme.dim;
    zigzag(ctx, back, wall, middle, 7, 0.012 * k);
    for (const part of [0.22, 0.78]) zigzag(ctx, face + PLATE * k, front, top + part * high, 3, 0.006 * k);
    hatch(ctx, wall, top - 0.01 * k, high + 0.02 * k);
    ctx.fillStyle = theme.body;
    ctx.strokeStyle = theme.axis;
    block(ctx, front, top, DEPTH * k, high);
    ctx.fillStyle = touch ? theme.contact : theme.dim;
    ctx.fillRect(face, top, Math.max(2, PLATE * k), high);
    ctx.font = theme.small;
    ctx.fillStyle = theme.text;
    ctx.textAlign = "center";
    ctx.textBaseline = "middle";
    if (DEPTH * k > 22) ctx.fillText("m", (front + back) / 2, top + high - 10);
    ctx.fillStyle = theme.dim;
    ctx.fillText("k_s", (back + wall) / 2, middle - 0.012 * k - 9);
  }

  _targets(ctx, { x_rd, x_md }) {
    const g = this.bench.layout.geometry;
    ctx.lineWidth = 1.2;
    ctx.font = theme.small;
    ctx.textBaseline = "alphabetic";
    ctx.strokeStyle = theme.good;
    ctx.fillStyle = theme.good;
    ctx.setLineDash([4, 3]);
    const top = Math.max(this._y(g.x_rd2 + ABOVE) - 12, this.inner.y + 16);
    line(ctx, this._x(x_md), top, this._x(x_md), this._y(g.x_rd2 - BELOW) + 5);
    ctx.textAlign = "center";
    ctx.fillText("x_md", this._x(x_md), top - 4);
    ctx.strokeStyle = theme.axis;
    const low = this._y(g.x_rd2 - BELOW);
    line(ctx, this._x(g.x_0), this._y(g.x_rd2 + ABOVE), this._x(g.x_0), low + 12);
    ctx.setLineDash([]);
    ctx.fillStyle = theme.dim;
    ctx.fillText("x_0", this._x(g.x_0), low + 23);
    const [x, y] = [this._x(x_rd[0]), this._y(x_rd[1])];
    ctx.strokeStyle = theme.trace(0);
    line(ctx, x - 7, y, x + 7, y);
    line(ctx, x, y - 7, x, y + 7);
  }

  _trail(ctx, { row }) {
    const { bench } = this, { history } = bench;
    const c1 = history.place.get("x_r1"), c2 = history.place.get("x_r2");
    if (c1 === undefined || c2 === undefined) return;
    const every = Math.max(1, Math.round(TRAIL / bench.dt / POINTS));
    ctx.strokeStyle = theme.trace(1);
    ctx.lineWidth = 1.3;
    ctx.globalAlpha = 0.75;
    ctx.beginPath();
    let down = false;
    // Points fixed in time, so that the trail does not shimmer.
    for (let r = Math.ceil((row - POINTS * every) / every) * every; r <= row; r += every) {
      const a = history.at(c1, r), b = history.at(c2, r);
      if (a !== a) {
        down = false;
        continue;
      }
      if (down) ctx.lineTo(this._x(a), this._y(b));
      else ctx.moveTo(this._x(a), this._y(b));
      down = true;
    }
    ctx.stroke();
    ctx.globalAlpha = 1;
  }

  _arm(ctx, { elbow, tip, touch }) {
    const points = [[0, 0], elbow, tip].map(([a, b]) => [this._x(a), this._y(b)]);
    ctx.lineCap = "round";
    ctx.lineJoin = "round";
    for (const [colour, wide] of [[theme.axis, 11], [theme.body, 8.5]]) {
      ctx.strokeStyle = colour;
      ctx.lineWidth = wide;
      ctx.beginPath();
      points.forEach(([x, y], i) => (i ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
      ctx.stroke();
    }
    ctx.lineCap = "butt";
    dot(ctx, points[0], 10, theme.body, theme.text);
    dot(ctx, points[0], 3, theme.text);
    dot(ctx, points[1], 5.5, theme.plot, theme.text);
    dot(ctx, points[2], 4.5, touch ? theme.contact : theme.trace(1), theme.plot);
  }

  _force(ctx, { tip, F_m }) {
    if (!(F_m > FAINT)) return;
    // The length grows with the logarithm: one newton and a kilonewton are both to be seen.
    const part = Math.min(1, Math.log(F_m / FAINT) / Math.log(STRONG / FAINT));
    const x = this._x(tip[0]), y = this._y(tip[1]), long = 10 + 34 * part;
    ctx.strokeStyle = ctx.fillStyle = theme.contact;
    ctx.lineWidth = 2.4;
    line(ctx, x, y, x + long - 6, y);
    ctx.beginPath();
    ctx.moveTo(x + long + 2, y);
    ctx.lineTo(x + long - 8, y - 5);
    ctx.lineTo(x + long - 8, y + 5);
    ctx.fill();
    ctx.font = theme.bold;
    ctx.textAlign = "right";
    ctx.textBaseline = "alphabetic";
    ctx.fillText(`F_m ${quantity(F_m, "N")}`, this.inner.x + this.inner.w - 8, this.inner.y + this.inner.h - 10);
  }
}

/** Boxes of plane and contact: one above the other in a column, side by side in a strip. */
function divide(w, h) {
  const gap = 8;
  if (w > 1.35 * h) {
    const left = Math.min(w * 0.58, h * 1.25);
    return [{ x: 0, y: 0, w: left, h }, { x: left + gap, y: 0, w: w - left - gap, h }];
  }
  const low = Math.max(196, Math.min(420, h - w * 1.12));
  return [{ x: 0, y: 0, w, h: h - low - gap }, { x: 0, y: h - low, w, h: low }];
}

function line(ctx, a, b, c, d) {
  ctx.beginPath();
  ctx.moveTo(a, b);
  ctx.lineTo(c, d);
  ctx.stroke();
}

function block(ctx, x, y, w, h) {
  ctx.fillRect(x, y, w, h);
  ctx.lineWidth = 1;
  ctx.strokeRect(x + 0.5, y + 0.5, w - 1, h - 1);
}

function dot(ctx, [x, y], r, fill, edge) {
  ctx.beginPath();
  ctx.arc(x, y, r, 0, 2 * Math.PI);
  ctx.fillStyle = fill;
  ctx.fill();
  if (!edge) return;
  ctx.strokeStyle = edge;
  ctx.lineWidth = 1.4;
  ctx.stroke();
}
