// The one connection of a page to its bench: layout, rows, events; shared by all elements.

import { wanted } from "./config.js";
import { History } from "./history.js";
import { Marks } from "./marks.js";

/** Bytes of the head of a message: two doubles, two whole numbers. */
const HEAD = 24;
const RATE = 30;
/** What of the past is asked for at first [s]. */
const PAST = 28;

export class Bench extends EventTarget {
  constructor(base = "") {
    super();
    this.base = base;
    this.layout = null;
    this.history = null;
    this.marks = new Marks();
    this.head = 0;
    this.connected = false;
    this.problem = "connecting";
    this.stats = { messages: 0, bytes: 0, skipped: 0, reconnects: 0 };
    this._receive = this._receive.bind(this);
    this._start();
  }

  get dt() {
    return this.layout?.dt ?? 5e-4;
  }

  /** Number of the row after the newest that is here and has been played. */
  get end() {
    return this.history ? Math.min(this.history.end, Math.max(this.head, 0)) : 0;
  }

  /** Value of a column at a row; NaN without one. */
  value(name, row) {
    const c = this.history?.place.get(name);
    return c === undefined ? NaN : this.history.at(c, row);
  }

  /** Set-point of the mass [m] at a row: what its error is measured from, (16). */
  target(row) {
    const found = this.value("e_m", row) + this.value("x_m_measured", row);
    return found === found ? found : this.layout.geometry.x_md;
  }

  /** Seconds for which no row has come although the bench is live. */
  get silent() {
    return this.layout?.mode === "live" && this._moved ? (performance.now() - this._moved) / 1000 : 0;
  }

  async _start() {
    try {
      const answer = await fetch(`${this.base}/live/layout.json`, { cache: "no-store" });
      if (!answer.ok) throw new Error(answer.status === 503 ? "no host yet" : `refused (${answer.status})`);
      this._begin(await answer.json());
    } catch (error) {
      this._lost(error.message === "Failed to fetch" ? "page server not reached" : error.message);
    }
  }

  _begin(layout) {
    const again = this.layout && this.layout.generation === layout.generation;
    this.layout = layout;
    this.units = new Map(layout.columns.map((c) => [c.name, c.unit]));
    this.meanings = new Map(layout.columns.map((c) => [c.name, c.meaning]));
    if (!again) {
      const names = wanted(layout.columns.map((c) => c.name));
      this.history = new History(names);
      this.marks = new Marks();
      this.head = layout.head;
      this.dispatchEvent(new Event("layout"));
    }
    this._open();
  }

  _open() {
    const url = new URL(`${this.base}/live/telemetry`, location.href);
    url.protocol = url.protocol.replace("http", "ws");
    const socket = new WebSocket(url);
    this._socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.connected = true;
      this.problem = "";
      this._subscribe();
    };
    socket.onmessage = this._receive;
    socket.onclose = (event) => {
      if (this._socket === socket) this._lost(event.reason || "connection lost");
    };
  }

  _subscribe() {
    const { layout, history } = this;
    const past = layout.mode === "live" ? layout.head - Math.round(PAST / layout.dt) : 0;
    const since = Math.max(0, history.started ? history.end : past);
    this._say({ columns: history.names, since, generation: layout.generation });
  }

  _say(message) {
    this._asked = performance.now();
    if (this._socket?.readyState === WebSocket.OPEN) this._socket.send(JSON.stringify(message));
  }

  _lost(problem) {
    this.connected = false;
    this.problem = problem;
    this.stats.reconnects++;
    this.dispatchEvent(new Event("rows"));
    setTimeout(() => this._start(), 500);
  }

  _receive({ data }) {
    if (typeof data === "string") return this._word(JSON.parse(data));
    const view = new DataView(data);
    const first = view.getFloat64(0, true), head = view.getFloat64(8, true);
    const count = view.getUint32(16, true), width = view.getUint32(20, true);
    const { history } = this;
    if (width !== history.names.length) return;
    if (count) {
      if (history.started && first > history.end) this.stats.skipped += first - history.end;
      const before = history.end;
      history.append(first, count, new Float32Array(data, HEAD, count * width));
      this.marks.follow(history, Math.max(before, history.first), history.end);
    }
    if (head !== this.head || !this._moved) this._moved = performance.now();
    this.head = head;
    this.stats.messages++;
    this.stats.bytes += data.byteLength;
    this.dispatchEvent(new Event("rows"));
    // The client paces: it asks when it has dealt with the last answer.
    const next = history.started ? history.end : first;
    // A hidden page has no timers to speak of: there the server waits.
    if (document.hidden) return this._say({ next, wait: 1 });
    const wait = Math.max(0, this._asked + 1000 / RATE - performance.now());
    setTimeout(() => this._say({ next }), wait);
  }

  _word(message) {
    if ("event" in message) {
      this.marks.tell(message.event);
      this.dispatchEvent(new CustomEvent("event", { detail: message.event }));
    }
    if ("changed" in message) {
      // Another host: everything starts over.
      const socket = this._socket;
      this._socket = null;
      socket?.close();
      setTimeout(() => this._start(), message.changed === null ? 500 : 0);
    }
  }
}

let shared = null;

/** The bench of this page. */
export function bench() {
  shared ??= new Bench();
  return shared;
}
