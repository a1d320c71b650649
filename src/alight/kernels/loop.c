/* Appended to the generated tick: runs it n times without leaving C.
   Stops after a tick that trips (last entry of y) or gives a number that is not finite. */

static int alight_finite(const double* v, long long n) {
  double zero = 0;
  long long i;
  for (i = 0; i < n; ++i) zero += v[i] * 0;
  return zero == 0;
}

ALIGHT_EXPORT long long alight_run(long long n, double* x, const double* noise, const double* p,
                                   double* y) {
  const double* arg[ALIGHT_SZ_ARG];
  double* res[ALIGHT_SZ_RES];
  long long int iw[ALIGHT_SZ_IW];
  double w[ALIGHT_SZ_W];
  double x_next[ALIGHT_N_OUT0];
  long long k, i;
  for (k = 0; k < n; ++k) {
    double* row = y + k * ALIGHT_N_OUT1;
    arg[0] = x;
    arg[1] = noise + k;
    arg[2] = p;
    res[0] = x_next;
    res[1] = row;
    ALIGHT_TICK(arg, res, iw, w, 0);
    for (i = 0; i < ALIGHT_N_OUT0; ++i) x[i] = x_next[i];
    if (row[ALIGHT_N_OUT1 - 1] != 0 || !alight_finite(row, ALIGHT_N_OUT1)) return k + 1;
  }
  return n;
}
