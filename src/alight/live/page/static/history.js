// Rows of telemetry by number: the newest at full rate, and minima and maxima of all of them.

/** Rows kept at full rate: 131 s at 2 kHz. */
export const FULL = 1 << 18;
/** Rows in a bin of either level of minima and maxima. */
export const BINS = [16, 256];
/** Bins kept of either level: 17 and 35 minutes at 2 kHz. */
const KEPT = [1 << 17, 1 << 14];

class Column {
  constructor() {
    this.values = new Float32Array(FULL);
    this.low = KEPT.map((n) => new Float32Array(n));
    this.high = KEPT.map((n) => new Float32Array(n));
  }
}

export class History {
  /** @param {string[]} names columns, in the order of what `append` gets */
  constructor(names) {
    this.names = names;
    this.columns = names.map(() => new Column());
    this.place = new Map(names.map((name, i) => [name, i]));
    this.clear();
  }

  clear() {
    /** Number of the first row that was ever received, and that of the row to come next. */
    this.first = 0;
    this.end = 0;
    this.started = false;
    this._range = new Float64Array(2);
  }

  has(name) {
    return this.place.has(name);
  }

  /** Number of the oldest row of which something is kept, and of the oldest at full rate. */
  get oldest() {
    return Math.max(this.first, this.end - (KEPT[1] - 1) * BINS[1]);
  }

  get oldestFull() {
    return Math.max(this.first, this.end - FULL);
  }

  /**
   * Take rows: column after column, `count` values each, the first of them row `first`.
   * Rows that were left out become a gap; rows that are here already are not taken again.
   */
  append(first, count, data) {
    if (!this.started) {
      this.first = this.end = first;
      this.started = true;
    }
    if (first > this.end) this._leaveOut(first);
    const known = Math.min(this.end - first, count);
    for (let c = 0; c < this.columns.length; c++) {
      this._write(this.columns[c], this.end, data, c * count + known, count - known);
    }
    this.end += count - known;
  }

  _leaveOut(row) {
    const span = Math.min(row - this.end, KEPT[1] * BINS[1]);
    const gap = new Float32Array(4096).fill(NaN);
    for (const column of this.columns) {
      for (let at = row - span; at < row; at += gap.length) {
        this._write(column, at, gap, 0, Math.min(gap.length, row - at));
      }
    }
    this.end = row;
  }

  _write(column, row, data, from, count) {
    const { values } = column;
    for (let i = 0; i < count; i++) values[(row + i) & (FULL - 1)] = data[from + i];
    for (let level = 0; level < BINS.length; level++) {
      const size = BINS[level], mask = KEPT[level] - 1;
      const low = column.low[level], high = column.high[level];
      let i = 0;
      while (i < count) {
        const bin = Math.floor((row + i) / size);
        const upto = Math.min(count, (bin + 1) * size - row);
        const slot = bin & mask;
        // A bin of which the first rows never came starts here too.
        const fresh = (row + i) % size === 0 || row + i === this.first;
        let lo = fresh ? NaN : low[slot], hi = fresh ? NaN : high[slot];
        for (; i < upto; i++) {
          const v = data[from + i];
          if (v !== v) continue;
          if (!(lo <= v)) lo = v;
          if (!(hi >= v)) hi = v;
        }
        low[slot] = lo;
        high[slot] = hi;
      }
    }
  }

  /** Value of a column at a row, NaN where none is kept at full rate. */
  at(c, row) {
    return row >= this.oldestFull && row < this.end ? this.columns[c].values[row & (FULL - 1)] : NaN;
  }

  /**
   * Least and greatest value of a column over the rows from `a` to before `b`, into `out`;
   * NaN where there is none. What the range touches is never left out: over old or wide ranges
   * whole bins count.
   */
  range(c, a, b, out) {
    a = Math.max(a, this.oldest);
    b = Math.min(b, this.end);
    let lo = NaN, hi = NaN;
    if (b > a) {
      const column = this.columns[c];
      const fine = b - a < 4 * BINS[0] && a >= this.oldestFull;
      if (fine) {
        const { values } = column;
        for (let row = a; row < b; row++) {
          const v = values[row & (FULL - 1)];
          if (v !== v) continue;
          if (!(lo <= v)) lo = v;
          if (!(hi >= v)) hi = v;
        }
      } else {
        const coarse = b - a >= 4 * BINS[1] || a < this.end - (KEPT[0] - 1) * BINS[0];
        const level = coarse ? 1 : 0;
        const mask = KEPT[level] - 1, low = column.low[level], high = column.high[level];
        const last = Math.floor((b - 1) / BINS[level]);
        for (let bin = Math.floor(a / BINS[level]); bin <= last; bin++) {
          const l = low[bin & mask], h = high[bin & mask];
          if (!(lo <= l) && l === l) lo = l;
          if (!(hi >= h) && h === h) hi = h;
        }
      }
    }
    out[0] = lo;
    out[1] = hi;
  }
}
