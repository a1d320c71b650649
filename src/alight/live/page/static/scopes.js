// <alight-scopes>: the strip charts, and the bar above them.

import { SCOPES } from "./config.js";
import { digitsOf, duration, fixed, niceStep } from "./format.js";
import { Gestures } from "./gestures.js";
import { Overlay } from "./overlay.js";
import { Strip } from "./strip.js";
import { fit, Painter, theme } from "./theme.js";
import { timeline } from "./timeline.js";
import { Toolbar } from "./toolbar.js";

export const LANE = 17, AXIS = 17, GAP = 8, BAR = 34;
const KEPT = "alight-scopes";

export class Scopes extends HTMLElement {
  constructor() {
    super();
    this.attachShadow({ mode: "open" });
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "strip charts of the bench's signals");
    this.toolbar = new Toolbar(this);
    this.shadowRoot.append(this.toolbar.style, this.toolbar.root, this.canvas);
    this.time = timeline();
    this.bench = this.time.bench;
    this.strips = [];
    this.hidden_ = new Set(load().hidden ?? []);
    this.enlarged = null;
    this.painter = new Painter(() => this.draw());
    this.overlay = new Overlay(this);
    this.view = { ticks: [], ratio: 1, left: 0, right: 1 };
    this.view.x = (plot, row) => plot.x + ((row + 0.5 - this.view.left) * plot.w) / (this.view.right - this.view.left);
    for (const name of ["shade", "marks", "cursors"]) this.view[name] = this.overlay[name].bind(this.overlay);
  }

  connectedCallback() {
    const want = () => this.painter.want();
    this._observer = new ResizeObserver(want);
    this._observer.observe(this);
    this._onLayout = () => this._make();
    this._onRows = () => (this.time.paused && this.bench.connected ? this.toolbar.refresh() : want());
    this._onChange = want;
    this.bench.addEventListener("layout", this._onLayout);
    this.bench.addEventListener("rows", this._onRows);
    this.time.addEventListener("change", this._onChange);
    theme.addEventListener("change", this._onChange);
    this.gestures = new Gestures(this);
    if (this.bench.layout) this._make();
    want();
  }

  disconnectedCallback() {
    this._observer.disconnect();
    this.bench.removeEventListener("layout", this._onLayout);
    this.bench.removeEventListener("rows", this._onRows);
    this.time.removeEventListener("change", this._onChange);
    theme.removeEventListener("change", this._onChange);
    this.gestures.release();
  }

  _make() {
    this.strips = SCOPES.map((spec) => new Strip(spec, this.bench)).filter((strip) => !strip.empty);
    this.toolbar.list();
    this.painter.want();
  }

  /** The scopes that are drawn now. */
  get shown() {
    if (this.enlarged) return this.strips.filter((s) => s.spec.id === this.enlarged);
    return this.strips.filter((s) => !this.hidden_.has(s.spec.id));
  }

  /** Show a scope or not. */
  display(id, on) {
    if (on) this.hidden_.delete(id);
    else this.hidden_.add(id);
    save({ hidden: [...this.hidden_] });
    this.painter.want();
  }

  /** Give all room to one scope, or to all again. */
  enlarge(id) {
    this.enlarged = this.enlarged === id ? null : id;
    this.painter.want();
  }

  /** Box of each shown scope, for a given size of the canvas. */
  arrange(width, height) {
    const { shown } = this;
    const across = shown.length <= 1 ? 1 : Math.max(1, Math.min(3, Math.floor(width / 300), Math.ceil(shown.length / 2)));
    const w = (width - GAP * (across - 1)) / across;
    const placed = [];
    let next = 0;
    for (let column = 0; column < across; column++) {
      const down = Math.ceil((shown.length - next) / (across - column)), h = (height - LANE - AXIS) / down;
      for (let row = 0; row < down; row++, next++) {
        const box = { x: column * (w + GAP), y: LANE + row * h, w, h };
        placed.push({ strip: shown[next], box, top: row === 0, bottom: row === down - 1 });
      }
    }
    return placed;
  }

  draw() {
    const { canvas, bench, time, view } = this;
    const width = this.clientWidth, height = this.clientHeight - BAR;
    if (width < 60 || height < 60) return;
    fit(canvas, width, height);
    const ctx = (this.ctx ??= canvas.getContext("2d", { alpha: false }));
    const ratio = window.devicePixelRatio || 1;
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.fillStyle = theme.ground;
    ctx.fillRect(0, 0, width, height);
    this.toolbar.refresh();
    if (!bench.history || !this.strips.length) return this._waiting(ctx, width, height);
    view.ratio = ratio;
    view.left = time.left;
    view.right = time.right;
    this.gestures.follow();
    view.shown = time.shown;
    view.span = time.span;
    view.paused = time.paused;
    this.placed = this.arrange(width, height);
    this._ticks();
    const now = performance.now();
    for (const { strip, box, top, bottom } of this.placed) {
      strip.alone = this.placed.length === 1;
      strip.draw(ctx, box, view, now);
      if (top) this.overlay.lane(ctx, strip.plot, view, box.y - LANE);
      if (bottom) this._axis(ctx, strip.plot, box.y + box.h);
    }
    this.toolbar.buttons(this.placed);
  }

  _waiting(ctx, width, height) {
    ctx.font = theme.font;
    ctx.fillStyle = theme.dim;
    ctx.textAlign = "center";
    ctx.fillText(this.bench.problem || "waiting for telemetry", width / 2, height / 2);
  }

  _ticks() {
    const { view, time, bench } = this;
    const { dt } = bench, pixels = this.placed[0]?.box.w ?? 300;
    this.step = niceStep(time.span / Math.max(2, (pixels - 50) / 44));
    if (this.step > 10) this.step = [15, 30, 60, 120, 300].find((s) => s >= this.step * 0.999) ?? 300;
    const origin = bench.marks.origin(time.right), rows = this.step / dt;
    view.ticks.length = 0;
    for (let k = Math.ceil((view.left - origin) / rows - 1e-6); origin + k * rows <= view.right; k++) view.ticks.push(origin + k * rows);
  }

  _axis(ctx, plot, y) {
    const { view, time } = this;
    const milli = time.span < 0.5, digits = digitsOf(milli ? this.step * 1000 : this.step);
    ctx.font = theme.small;
    ctx.fillStyle = theme.dim;
    ctx.textBaseline = "alphabetic";
    ctx.textAlign = "center";
    const unit = milli ? "ms" : "s";
    ctx.textAlign = "right";
    ctx.fillText(unit, plot.x + plot.w, y + 11);
    const stop = plot.x + plot.w - ctx.measureText(unit).width - 4;
    ctx.textAlign = "center";
    for (const row of view.ticks) {
      const seconds = time.seconds(row), x = view.x(plot, row - 0.5);
      const text = fixed(milli ? seconds * 1000 : seconds, digits);
      const half = ctx.measureText(text).width / 2;
      if (x + half < stop && x - half > plot.x - 30) ctx.fillText(text, x, y + 11);
    }
  }

  /** The scope and its plot under a point of the canvas. */
  under(x, y) {
    return this.placed?.find(({ box }) => x >= box.x && x < box.x + box.w && y >= box.y && y < box.y + box.h)?.strip ?? null;
  }

  /** Row at a place along a plot. */
  rowAt(plot, x) {
    const { left, right } = this.view;
    return left - 0.5 + ((x - plot.x) * (right - left)) / plot.w;
  }

  /** Words for the bar: the cursors and what lies between them. */
  cursorText() {
    const { time } = this;
    const [a, b] = time.cursors;
    const one = (row) => `${fixed(time.seconds(row), 4)} s`;
    if (a !== null && b !== null) {
      const d = Math.abs(b - a) * this.bench.dt;
      return `A ${one(a)}   B ${one(b)}   Δt ${d < 1 ? `${fixed(d * 1000, 1)} ms` : `${fixed(d, 4)} s`}`;
    }
    if (a !== null) return `A ${one(a)}`;
    if (time.hover !== null) return `t ${one(time.shown)}`;
    return "";
  }

  spanText() {
    return duration(this.time.span);
  }
}

function load() {
  try {
    return JSON.parse(localStorage.getItem(KEPT)) ?? {};
  } catch {
    return {};
  }
}

function save(content) {
  try {
    localStorage.setItem(KEPT, JSON.stringify(content));
  } catch {
    // A browser that keeps nothing shows all scopes again.
  }
}
