/* Appended to a generated step (u, x, p) -> (x_next, y): makes it work in place on one array of
   doubles that holds u, x, p and y in this order. It is presented to CasADi as a function of that
   array, since CasADi's buffers are the shortest way from Python into C. */

#define ALIGHT_BLOCK (ALIGHT_N_IN0 + ALIGHT_N_IN1 + ALIGHT_N_IN2 + ALIGHT_N_OUT1)

static const long long int alight_sparsity[3] = {ALIGHT_BLOCK, 1, 1};

static void alight_once(double* block) {
  const double* arg[ALIGHT_SZ_ARG];
  double* res[ALIGHT_SZ_RES];
  long long int iw[ALIGHT_SZ_IW];
  double w[ALIGHT_SZ_W];
  double x_next[ALIGHT_N_OUT0];
  double* x = block + ALIGHT_N_IN0;
  long long int i;
  arg[0] = block;
  arg[1] = x;
  arg[2] = x + ALIGHT_N_IN1;
  res[0] = x_next;
  res[1] = x + ALIGHT_N_IN1 + ALIGHT_N_IN2;
  ALIGHT_TICK(arg, res, iw, w, 0);
  for (i = 0; i < ALIGHT_N_OUT0; ++i) x[i] = x_next[i];
}

ALIGHT_EXPORT void alight_repeat(double* block, long long int n) {
  while (n-- > 0) alight_once(block);
}

ALIGHT_EXPORT int alight_step(const double** arg, double** res, long long int* iw, double* w,
                              int mem) {
  (void)res, (void)iw, (void)w, (void)mem;
  alight_once((double*)arg[0]);
  return 0;
}

ALIGHT_EXPORT long long int alight_step_n_in(void) { return 1; }

ALIGHT_EXPORT long long int alight_step_n_out(void) { return 0; }

ALIGHT_EXPORT const long long int* alight_step_sparsity_in(long long int i) {
  return i == 0 ? alight_sparsity : 0;
}

ALIGHT_EXPORT const long long int* alight_step_sparsity_out(long long int i) {
  (void)i;
  return 0;
}
