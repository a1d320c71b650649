/* Appended to the generated kept(), usual(), seldom() and fold(): advances LANES runs side by side.

   Arrays hold one entry after another, each for all lanes, and are aligned to 64 bytes. A lane
   whose run trips is read out at once; what it computes afterwards is not looked at. */

#if defined(__x86_64__) || defined(__i386__)
#include <xmmintrin.h>
/* Subnormal numbers, into which a decaying state runs, cost a hundred times a normal operation. */
static unsigned fast_subnormals(void) {
  const unsigned before = _mm_getcsr();
  _mm_setcsr(before | 0x8040u);
  return before;
}
static void restore_subnormals(unsigned before) { _mm_setcsr(before); }
#elif defined(__aarch64__)
static unsigned long fast_subnormals(void) {
  unsigned long before;
  __asm__ volatile("mrs %0, fpcr" : "=r"(before));
  __asm__ volatile("msr fpcr, %0" : : "r"(before | (1ul << 24)));
  return before;
}
static void restore_subnormals(unsigned long before) {
  __asm__ volatile("msr fpcr, %0" : : "r"(before));
}
#else
static int fast_subnormals(void) { return 0; }
static void restore_subnormals(int before) { (void)before; }
#endif

static void read_out(const V *from, int count, unsigned lanes, double *to) {
  for (int i = 0; i < count; ++i)
    V_EACH(lane)
      if (lanes >> lane & 1) to[i * LANES + lane] = v_get(from[i], lane);
}

typedef struct {
  long long ticks;        /* ticks to run */
  long long first;        /* number of the first one */
  long long every;        /* ticks between two recorded rows */
  long long noise_stride; /* numbers of noise for a tick: 1 if all runs share them, or LANES */
  const double *p;        /* parameters of the loop and of the metrics */
  const double *noise;
  double *x;      /* state, NX: before the first tick, after the last one or after the trip */
  double *memory; /* of the metrics, NM */
  double *alive;  /* 1 while the run goes on */
  double *done;   /* ticks before the trip */
  double *trip;   /* code of the trip */
  double *rows;   /* recorded entries, NR for every row, or NULL */
} Batch;

ALIGHT_EXPORT void alight_batch(const Batch *b) {
  static const int recorded[NR + 1] = RECORDED;
  V x[NX], x_next[NX], y[NY], given[NG], head[NH], lost[1], calls[1], memory[NM + 1], memory_next[NM + 1];
  V usual_kept[NK_USUAL + 1], seldom_kept[NK_SELDOM + 1];
  const unsigned long before = fast_subnormals();
  M alive = m_from_value(v_load(b->alive));
  double *row = b->rows;
  usual_keep(b->p, usual_kept);
  seldom_keep(b->p, seldom_kept);
  for (int i = 0; i < NX; ++i) /* NaN takes none of the branches that cost time */
    x[i] = v_select(alive, v_load(b->x + i * LANES), v_set(NAN));
  for (int i = 0; i < NM; ++i) memory[i] = v_load(b->memory + i * LANES);
  for (long long k = b->first; k < b->first + b->ticks && m_any(alive); ++k) {
    const double *noise = b->noise + (k - b->first) * b->noise_stride;
    const V w[1] = {b->noise_stride == 1 ? v_set(*noise) : v_load(noise)};
    const V now[1] = {v_set((double)k)};
    usual(x, w, memory, now, b->p, usual_kept, x_next, y, given, calls, memory_next);
    const M switched = m_and(m_from_value(calls[0]), alive);
    if (__builtin_expect(m_any(switched), 0)) {
      for (int i = 0; i < NH; ++i) head[i] = x[i];
      for (int step = 0; step < REPEATS; ++step) {
        V before_step[NH];
        for (int i = 0; i < NH; ++i) before_step[i] = head[i];
        seldom(before_step, given, b->p, seldom_kept, head, lost);
        const M failed = m_and(switched, m_not(m_from_value(y[NY - 1])));
        y[NY - 1] = v_select(failed, lost[0], y[NY - 1]);
      }
      for (int i = 0; i < NH; ++i) x_next[i] = v_select(switched, head[i], x_next[i]);
    }
    const M tripped = m_and(m_from_value(y[NY - 1]), alive);
    if (__builtin_expect(m_any(tripped), 0)) {
      const unsigned lanes = m_bits(tripped);
      read_out(x_next, NX, lanes, b->x);
      read_out(memory, NM, lanes, b->memory);
      read_out(y + NY - 1, 1, lanes, b->trip);
      V_EACH(lane) if (lanes >> lane & 1) b->done[lane] = (double)k;
      alive = m_and(alive, m_not(tripped));
      for (int i = 0; i < NX; ++i)
        x_next[i] = v_select(tripped, v_set(NAN), x_next[i]);
    }
    if (row && k % b->every == 0)
      for (int i = 0; i < NR; ++i, row += LANES) v_store(row, y[recorded[i]]);
    for (int i = 0; i < NX; ++i) x[i] = x_next[i];
    for (int i = 0; i < NM; ++i) memory[i] = memory_next[i];
  }
  const unsigned lanes = m_bits(alive);
  read_out(x, NX, lanes, b->x);
  read_out(memory, NM, lanes, b->memory);
  V_EACH(lane) if (lanes >> lane & 1) b->done[lane] = (double)(b->first + b->ticks);
  v_store(b->alive, v_from_mask(alive));
  restore_subnormals(before);
}

ALIGHT_EXPORT int alight_lanes(void) { return LANES; }
