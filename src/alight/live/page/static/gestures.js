// Pointer and keys on the scopes.

import { LANE } from "./scopes.js";

/** What keeps keys for itself: all of them, or the one that presses it. */
const FIELDS = "input:not([type=checkbox]), textarea, select, [contenteditable], [role=slider], [role=textbox]";
const PRESSED = "button, summary, input[type=checkbox], a, [role=button], [role=tab]";
const NEAR = 5;

export class Gestures {
  constructor(scopes) {
    this.scopes = scopes;
    this.time = scopes.time;
    this._stop = new AbortController();
    const { signal } = this._stop, { canvas } = scopes;
    const on = (target, name, handler, options = {}) => target.addEventListener(name, handler.bind(this), { signal, ...options });
    on(canvas, "wheel", this._wheel, { passive: false });
    on(canvas, "pointerdown", this._down);
    on(canvas, "pointermove", this._move);
    on(canvas, "pointerup", this._up);
    on(canvas, "pointercancel", this._leave);
    on(canvas, "pointerleave", this._leave);
    on(canvas, "dblclick", this._twice);
    on(scopes.hasAttribute("hotkeys") ? document : scopes, "keydown", this._key);
  }

  release() {
    this._stop.abort();
  }

  /** Where an event is: the scope, the row, whether on its scale. */
  _at(event) {
    const { left, top } = this.scopes.canvas.getBoundingClientRect();
    const x = event.clientX - left, y = event.clientY - top;
    const strip = this.scopes.under(x, y);
    const plot = strip?.plot;
    const inside = plot && x >= plot.x && x <= plot.x + plot.w;
    return { x, y, strip, plot, row: inside ? this.scopes.rowAt(plot, x) : null, scale: plot && x < plot.x, head: plot && y < plot.y };
  }

  _wheel(event) {
    const at = this._at(event);
    if (!at.strip) return;
    event.preventDefault();
    const factor = 1.2 ** Math.sign(event.deltaY || event.deltaX);
    if (at.scale || event.ctrlKey || event.altKey) this._stretch(at, factor);
    else if (event.shiftKey) this.time.pan(((this.time.span / this.time.bench.dt) * Math.sign(event.deltaY || event.deltaX)) / 10);
    else this.time.zoomBy(factor, at.row ?? this.time.right);
  }

  _stretch({ strip, y }, factor) {
    const { lo, hi } = strip.scale;
    const v = strip.valueAt(y);
    strip.manual = strip.log
      ? [v * (lo / v) ** factor, v * (hi / v) ** factor]
      : [v + (lo - v) * factor, v + (hi - v) * factor];
    this.scopes.painter.want();
  }

  _down(event) {
    if (event.button !== 0) return;
    const at = this._at(event);
    if (!at.strip) return;
    this.scopes.canvas.focus({ preventScroll: true });
    this.scopes.canvas.setPointerCapture(event.pointerId);
    const { plot } = at;
    const grabbed = at.row === null ? -1 : this.time.cursors.findIndex((row) => row !== null && Math.abs(this.scopes.view.x(plot, row) - at.x) < NEAR);
    if (at.head) this._hold = { kind: "head", at };
    else if (at.scale) this._hold = { kind: "scale", at, range: [at.strip.scale.lo, at.strip.scale.hi] };
    else if (grabbed >= 0) this._hold = { kind: "cursor", cursor: grabbed, plot };
    else if (event.shiftKey || event.altKey) this._hold = { kind: "pan", at, moved: 0, x: at.x };
    else this._hold = { kind: "span", at };
  }

  _move(event) {
    const at = this._at(event), hold = this._hold;
    if (!hold) {
      this._pointer = at.row !== null && !at.head ? at : null;
      this.time.point(this._pointer && at.row);
      this._explain(at);
      return;
    }
    const plot = hold.at?.plot ?? hold.plot;
    const row = plot && this.scopes.rowAt(plot, Math.max(plot.x, Math.min(plot.x + plot.w, at.x)));
    if (hold.kind === "cursor") this.time.place(hold.cursor, Math.min(row, this.time.bench.end - 1));
    if (hold.kind === "pan") {
      this.time.pan(((hold.x - at.x) * (this.time.span / this.time.bench.dt)) / plot.w);
      hold.x = at.x;
    }
    if (hold.kind === "scale") this._shift(hold, at);
    if (hold.kind === "span" && Math.abs(at.x - hold.at.x) > NEAR) {
      // What was marked stays in sight while it is being marked.
      if (!this.time.paused) this.time.pause();
      this.scopes.overlay.drag = [hold.at.row, row];
      this.scopes.painter.want();
    }
  }

  _shift({ at: from, range }, at) {
    const { strip } = from;
    const part = (at.y - from.y) / strip.plot.h;
    strip.manual = strip.log
      ? range.map((v) => v * (range[1] / range[0]) ** part)
      : range.map((v) => v + part * (range[1] - range[0]));
    this.scopes.painter.want();
  }

  _up(event) {
    const hold = this._hold, at = this._at(event);
    this._hold = null;
    const { drag } = this.scopes.overlay;
    this.scopes.overlay.drag = null;
    if (hold?.kind === "head" && at.strip === hold.at.strip) return this._legend(at);
    if (hold?.kind !== "span") return;
    if (drag) this.time.show(Math.min(...drag), Math.max(...drag));
    else if (hold.at.row !== null) {
      const second = event.shiftKey || event.ctrlKey || event.metaKey || (this.time.cursors[0] !== null && this.time.cursors[1] === null);
      this.time.place(second ? 1 : 0, Math.min(hold.at.row, this.time.bench.end - 1));
    }
  }

  /** A click on a name in the header shows or hides its trace. */
  _legend({ strip, x }) {
    const found = strip.legend?.find(({ from, upto }) => x >= from && x < upto);
    if (found) found.trace.hidden = !found.trace.hidden;
    this.scopes.painter.want();
  }

  /** The row under a pointer that rests while time runs by beneath it. */
  follow() {
    if (this._pointer) this.time.hover = Math.round(this.scopes.rowAt(this._pointer.plot, this._pointer.x));
  }

  _leave() {
    this._hold = this._pointer = null;
    this.scopes.overlay.drag = null;
    this.time.point(null);
  }

  _twice(event) {
    const at = this._at(event);
    if (!at.strip) return;
    if (at.scale) {
      at.strip.manual = null;
      this.scopes.painter.want();
    } else if (at.head) this.scopes.enlarge(at.strip.spec.id);
    else this.clear();
  }

  clear() {
    this.time.cursors = [null, null];
    for (const strip of this.scopes.strips) strip.manual = null;
    this._pointer = null;
    this.time.point(null);
    this.scopes.painter.want();
  }

  _explain(at) {
    const { canvas } = this.scopes;
    let text = "";
    if (at.y < LANE) text = this.scopes.overlay.told(at.x);
    else if (at.head) {
      const found = at.strip.legend?.find(({ from, upto }) => at.x >= from && at.x < upto);
      text = (found ? [found.trace] : at.strip.traces).map((t) => `${t.name}: ${t.meaning}${t.unit ? ` [${t.unit}]` : ""}`).join("\n");
    }
    if (canvas.title !== text) canvas.title = text;
    canvas.style.cursor = at.head ? "pointer" : at.scale ? "ns-resize" : "crosshair";
  }

  _key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const target = event.composedPath()[0];
    if (target?.matches?.(FIELDS) || (event.key === " " && target?.matches?.(PRESSED))) return;
    const { time } = this, rows = time.span / time.bench.dt;
    const acts = {
      " ": () => time.toggle(),
      "+": () => time.step(-1),
      "=": () => time.step(-1),
      "-": () => time.step(1),
      ArrowLeft: () => this._step(-1, event, rows),
      ArrowRight: () => this._step(1, event, rows),
      Home: () => time.pan(-1e15),
      End: () => time.live(),
      // Not Escape: that key stops the bench.
      c: () => (this.scopes.enlarged ? this.scopes.enlarge(this.scopes.enlarged) : this.clear()),
    };
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** With a cursor: the cursor by a sample (shift: ten); without: the window by a tenth. */
  _step(direction, event, rows) {
    const [a, b] = this.time.cursors;
    if (a === null) this.time.pan((direction * rows) / (event.shiftKey ? 2 : 10));
    else this.time.place(b === null ? 0 : 1, (b ?? a) + direction * (event.shiftKey ? 10 : 1));
  }
}
