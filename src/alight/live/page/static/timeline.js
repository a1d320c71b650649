// Which part of time is shown: shared by all scopes and the plan view of a page.

import { LONGEST, SHORTEST, WINDOWS } from "./config.js";
import { bench } from "./connection.js";

class Timeline extends EventTarget {
  constructor() {
    super();
    this.bench = bench();
    this.span = 10;
    this.paused = false;
    /** Row at the right edge while paused. */
    this._edge = 0;
    /** Row under the pointer, and those of the two cursors; null without one. */
    this.hover = null;
    this.cursors = [null, null];
    this.bench.addEventListener("layout", () => this.live());
  }

  get right() {
    return this.paused ? this._edge : this.bench.end;
  }

  get left() {
    return this.right - this.span / this.bench.dt;
  }

  /** Row whose values are shown: that of the pointer, of a cursor, or the newest. */
  get shown() {
    const row = this.hover ?? this.cursors[0] ?? this.right - 1;
    return Math.max(0, Math.min(row, this.bench.end - 1));
  }

  _changed() {
    this.dispatchEvent(new Event("change"));
  }

  pause() {
    if (this.paused) return;
    this._edge = this.bench.end;
    this.paused = true;
    this._changed();
  }

  live() {
    this.paused = false;
    this.cursors = [null, null];
    this._changed();
  }

  toggle() {
    if (this.paused) this.live();
    else this.pause();
  }

  /** Set the span [s]; the row `anchor` stays where it is while paused, else the right edge. */
  zoom(span, anchor = this.right) {
    span = Math.min(LONGEST, Math.max(SHORTEST, span));
    if (this.paused) this._edge = this._within(anchor + ((this.right - anchor) * span) / this.span);
    this.span = span;
    this._changed();
  }

  zoomBy(factor, anchor) {
    this.zoom(this.span * factor, anchor);
  }

  /** The next longer or shorter of the round spans. */
  step(direction) {
    const next = direction > 0 ? WINDOWS.find((w) => w > this.span * 1.001) : WINDOWS.findLast((w) => w < this.span * 0.999);
    if (next) this.zoom(next, (this.left + this.right) / 2);
  }

  /** Move by a part of the span; to the right end means live again only when asked for. */
  pan(rows) {
    this.pause();
    this._edge = this._within(this._edge + rows);
    this._changed();
  }

  /** Show just the rows from `a` to `b`, paused. */
  show(a, b) {
    if (!this.paused) this.pause();
    this.span = Math.min(LONGEST, Math.max(SHORTEST, (b - a) * this.bench.dt));
    this._edge = this._within((a + b + this.span / this.bench.dt) / 2);
    this._changed();
  }

  _within(row) {
    const { history } = this.bench;
    const rows = this.span / this.bench.dt;
    const oldest = history ? history.oldest : 0;
    return Math.max(Math.min(oldest + rows * 0.1, this.bench.end), Math.min(row, this.bench.end + rows * 0.5));
  }

  place(cursor, row) {
    this.cursors[cursor] = row === null ? null : Math.max(0, Math.round(row));
    this._changed();
  }

  point(row) {
    const at = row === null ? null : Math.round(row);
    if (at === this.hover) return;
    this.hover = at;
    this._changed();
  }

  /** Time of a row since the start of its run [s]. */
  seconds(row) {
    return (row - this.bench.marks.origin(this.right)) * this.bench.dt;
  }
}

let shared = null;

/** The timeline of this page. */
export function timeline() {
  shared ??= new Timeline();
  return shared;
}
