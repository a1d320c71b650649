// What the tests ask the display about, in the page itself.

globalThis.look = {
  /** Every value of a column since the first row, as base64 of float32. */
  column(name) {
    const { history } = alight.bench, c = history.place.get(name);
    const rows = Float32Array.from({ length: history.end - history.first }, (_, i) => history.at(c, history.first + i));
    return btoa(Array.from(new Uint8Array(rows.buffer), (b) => String.fromCharCode(b)).join(""));
  },

  scopes: () => document.querySelector("alight-scopes"),
  strip: (id) => look.scopes().strips.find((strip) => strip.spec.id === id),

  /** The plot of a scope, and where a row lies on it, in pixels of the page within the canvas. */
  place(id, row) {
    const { plot } = look.strip(id);
    return { ...plot, at: look.scopes().view.x(plot, row) };
  },

  /** How far the colour nearest to that of a trace is from it, where a value would be drawn. */
  off(id, row, value, trace) {
    const scopes = look.scopes(), strip = look.strip(id), ratio = devicePixelRatio;
    const x = Math.round(scopes.view.x(strip.plot, row) * ratio), y = Math.round(strip.scale.y(value) * ratio);
    const sample = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    sample.fillStyle = getComputedStyle(document.documentElement).getPropertyValue(`--al-trace-${trace}`);
    sample.fillRect(0, 0, 1, 1);
    const want = sample.getImageData(0, 0, 1, 1).data;
    sample.drawImage(scopes.canvas, x - 2, y - 2, 5, 5, 0, 0, 5, 5);
    const { data } = sample.getImageData(0, 0, 5, 5);
    let best = Infinity;
    for (let i = 0; i < data.length; i += 4) {
      best = Math.min(best, Math.max(...[0, 1, 2].map((k) => Math.abs(data[i + k] - want[k]))));
    }
    return best;
  },

  /** What the header of a scope says at a row. */
  said: (id, row) => look.strip(id).traces.map((trace) => look.strip(id).header.value(trace, row)),

  picture: () => look.scopes().canvas.toDataURL(),

  /** Wait for the next drawing. */
  async drawn() {
    const { painter } = look.scopes(), { frames } = painter;
    painter.want();
    while (painter.frames === frames) await new Promise(requestAnimationFrame);
  },
};
