// What happened, by row: read off the telemetry itself, worded by the events that come beside it.

const MOST = 4000;
const RUNNING = 1, STOPPED = 2, TRIPPED = 3;
const WORDS = { trip: "TRIP", "host lost": "HOST LOST", "rows lost": "rows lost" };

/** Short name of a parameter's path. */
const short = (path) => path.split(".").at(-1);

function value(v) {
  return Array.isArray(v) ? `[${v.map(value).join(", ")}]` : typeof v === "number" ? String(Number(v.toPrecision(4))) : String(v);
}

/** What an event says: its label, and what it says in full. */
export function worded(event) {
  const values = event.changes && typeof event.changes === "object" ? Object.entries(event.changes) : [];
  const full = values.map(([path, v]) => `${short(path)} = ${value(v)}`).join(", ");
  let label = WORDS[event.kind] ?? String(event.kind);
  if ((event.kind === "gains" || event.kind === "target") && values.length) label = values.length === 1 ? full : values.slice(0, 2).map(([path]) => short(path)).join(", ") + (values.length > 2 ? ", …" : "");
  if (event.kind === "law" && event.text) label = event.text;
  return { label, full: [event.text, full].filter(Boolean).join(" · ") };
}

export class Marks {
  constructor() {
    /** {row, kind, label, full}, by row. */
    this.list = [];
    /** Rows at which runs began. */
    this.starts = [];
    /** Times in contact: [row of its begin, row of its end or Infinity]. */
    this.contacts = [];
    /** Rows at which deadlines were missed. */
    this.misses = [];
    this._last = {};
  }

  /** Read the rows from `a` to before `b`. */
  follow(history, a, b) {
    const place = (name) => history.place.get(name);
    const state = place("state"), touch = place("Lambda"), missed = place("missed");
    for (let row = a; row < b; row++) {
      if (state !== undefined) this._state(row, history.at(state, row));
      if (touch !== undefined) this._contact(row, history.at(touch, row) > 0);
      if (missed !== undefined) this._step(row, "missed", history.at(missed, row));
    }
  }

  _state(row, now) {
    const before = this._last.state;
    if (now !== now || now === before) return;
    this._last.state = now;
    if (now === RUNNING) this.starts.push(row);
    if (before === undefined) return;
    if (now === RUNNING) this._add({ row, kind: "start" });
    else if (now === TRIPPED) this._add({ row, kind: "trip" });
    else if (now === STOPPED) this._add({ row, kind: "stop" });
    else if (before !== undefined) this._add({ row, kind: "reset" });
  }

  _contact(row, now) {
    if (now === (this._last.touch ?? false)) return;
    this._last.touch = now;
    if (now) {
      this.contacts.push([row, Infinity]);
      if (this.contacts.length > MOST) this.contacts.shift();
    } else if (this.contacts.length) this.contacts.at(-1)[1] = row;
  }

  _step(row, name, now) {
    const before = this._last[name];
    if (now !== now) return;
    if (name === "missed" && before !== undefined && now > before) {
      this.misses.push(row);
      if (this.misses.length > MOST) this.misses.shift();
    }
    this._last[name] = now;
  }

  /** Take an event that was told; it words the mark that the telemetry already shows. */
  tell(event) {
    const near = this.list.findLast((m) => m.kind === event.kind && !m.told && Math.abs(m.row - event.row) < 2000);
    if (near) Object.assign(near, worded(event), { told: true });
    else this._add({ ...event, told: true });
  }

  _add(event) {
    const made = { row: event.row, kind: event.kind, told: event.told ?? false, ...worded(event) };
    if (event.kind === "refused") return;
    // One that the telemetry shows after it was told.
    const known = !made.told && this.list.findLast((m) => m.told && m.kind === made.kind && Math.abs(m.row - made.row) < 2000 && !m.seen);
    if (known) {
      known.row = made.row;
      known.seen = true;
      return;
    }
    let i = this.list.length;
    while (i > 0 && this.list[i - 1].row > made.row) i--;
    this.list.splice(i, 0, made);
    if (this.list.length > MOST) this.list.shift();
  }

  /** Row at which the run that was on at a row began; 0 before the first. */
  origin(row) {
    for (let i = this.starts.length - 1; i >= 0; i--) if (this.starts[i] <= row) return this.starts[i];
    return this.starts[0] ?? 0;
  }
}
