// What the browser's memory of the rows answers when it was given runs of rows that are computed.

async ([path, runs, ranges]) => {
  const { History } = await import(path);
  const history = new History(["a"]);
  // The same numbers as in Python.
  const value = (row) => {
    const turned = ((row * 2654435761) % 4294967296) / 4294967296;
    return row % 997 === 0 ? NaN : Math.fround(turned);
  };
  for (const [first, count] of runs) {
    for (let at = 0; at < count; at += 5000) {
      const length = Math.min(5000, count - at);
      history.append(first + at, length, Float32Array.from({ length }, (_, i) => value(first + at + i)));
    }
  }
  const out = new Float64Array(2);
  const plain = (v) => (v === v ? v : null);
  const range = ([a, b]) => {
    history.range(0, a, b, out);
    return [...out].map(plain);
  };
  return {
    end: history.end,
    oldestFull: history.oldestFull,
    ranges: ranges.map(range),
    at: ranges.map(([a]) => plain(history.at(0, a))),
  };
};
