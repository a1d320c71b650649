// Which scopes there are, and which signals each of them shows: the one place to change it.
//
// traces: columns of the telemetry; of `a|b` the first that the bench has. `limit`: draw the
// limits of this column. `include`: values that the axis always shows. `of: "box"`: place of an
// estimate between its bounds, 0 to 1. `scale: "log"`: logarithmic unless switched.
// `target`: draw the set-point of the mass. `counter`: a number that only rises; its steps are marked. `wide`: this trace lies broad below
// the others, which are often equal to it.

export const SCOPES = [
  { id: "e_r", title: "tip error", traces: ["e_r1", "e_r2"], include: [0] },
  { id: "e_m", title: "mass error", traces: ["e_m"], include: [0] },
  { id: "tau1", title: "torque 1", wide: 1, traces: ["tau1", "torque1|tau_applied1"], limit: "torque1|tau_applied1|tau1", include: [0] },
  { id: "tau2", title: "torque 2", wide: 1, traces: ["tau2", "torque2|tau_applied2"], limit: "torque2|tau_applied2|tau2", include: [0] },
  { id: "F_m", title: "contact force", traces: ["F_m"], include: [0] },
  { id: "probe", title: "clearance", traces: ["probe_clearance"], limit: "probe_clearance", include: [0] },
  { id: "x", title: "position X1", traces: ["x_rd1", "x_r1", "x_m|x_m_measured"], target: true },
  {
    id: "estimates",
    title: "estimates",
    traces: ["theta_dk_hat", ...Array.from({ length: 12 }, (_, i) => `theta_r_hat${i + 1}`)],
    of: "box",
    lines: [0, 1],
    include: [0, 1],
  },
  { id: "V_r", title: "Lyapunov V_r", traces: ["V_r"], scale: "log" },
  { id: "timing", title: "timing", traces: ["busy", "late"], counter: "missed", include: [0] },
];

/** Columns that the plan view, the marks and the time axis read besides. */
export const BESIDES = [
  "t", "state", "trip", "law", "command", "Lambda", "gap", "x_r1", "x_r2", "x_rd1", "x_rd2",
  "x_m", "x_m_measured", "e_m", "q1", "q2", "elbow1", "elbow2", "deflection", "F_m", "F_t", "F1", "F2",
  "probe_clearance", "kick1", "kick2", "missed", "torque1", "torque2",
];

/** Spans of time that a window may have [s]. */
export const WINDOWS = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600];
export const SHORTEST = 0.05;
export const LONGEST = 600;

/** The columns to subscribe to, of those that a bench has. */
export function wanted(available) {
  const has = new Set(available);
  const found = new Set();
  for (const scope of SCOPES) {
    for (const trace of scope.traces) {
      const name = firstOf(trace, has);
      if (name) found.add(name);
    }
    if (scope.counter && has.has(scope.counter)) found.add(scope.counter);
  }
  for (const name of BESIDES) if (has.has(name)) found.add(name);
  return [...found];
}

/** Of `a|b|c` the first that there is. */
export function firstOf(names, has) {
  return names.split("|").find((name) => has.has(name));
}
