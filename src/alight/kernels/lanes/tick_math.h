/* What a tick needs beside vector_math.h: quotients, roots and turned angles, made for throughput.

   With AVX-512 a division or a root blocks its unit for 16 to 24 cycles; an approximation of
   14 bits and two steps of Newton's method take a third of it. Errors, as
   tests/kernels/lanes/test_tick_math.py measures them:

     div, inv          0.6 ulp   |operands| and |result| from 1e-280 to 1e280, or a dividend of 0
     root              0.8 ulp   from 1e-280 to 1e280, and 0; of less than 0 it is NaN
     sincos_turned     1.2 ulp   of 1, not of the result, which is that of the unrounded sum

   Beyond these ranges AVX-512 may give NaN where the result is 0 or infinite: over 0, over infinity,
   of infinity. No sign of zero is kept. */

#ifndef ALIGHT_TICK_MATH_H
#define ALIGHT_TICK_MATH_H

#include "vector_math.h"

#if ALIGHT_AVX512

/* 1/b to about 28 bits. */
V_INLINE V v_reciprocal(V b) {
  const V r = _mm512_rcp14_pd(b);
  return v_fma(r, v_fma(-b, r, v_set(1.0)), r);
}

V_INLINE V v_inv(V b) {
  const V r = v_reciprocal(b);
  return v_fma(r, v_fma(-b, r, v_set(1.0)), r);
}

V_INLINE V v_div(V a, V b) {
  const V r = v_reciprocal(b), q = a * r;
  return v_fma(v_fma(-b, q, a), r, q);
}

/* Root; of 0, whose inverse root is infinite, it is 0. */
V_INLINE V v_root(V a) {
  const V r = _mm512_maskz_rsqrt14_pd(m_ne(a, v_set(0.0)), a);
  V root = a * r, half = r * v_set(0.5); /* of the root, of its inverse */
  const V e = v_fma(-half, root, v_set(0.5));
  root = v_fma(root, e, root), half = v_fma(half, e, half);
  return v_fma(v_fma(-root, root, a), half, root);
}

#else
V_INLINE V v_inv(V b) { return v_set(1.0) / b; }
V_INLINE V v_div(V a, V b) { return a / b; }
V_INLINE V v_root(V a) { return v_sqrt(a); }
#endif

/* Largest turn [rad] for which what the series below leave out is less than a rounding. */
#define SMALL_TURN (1.0 / 64)

static __attribute__((noinline, unused)) void v_sincos_far(V x, V turn, V *s, V *c) {
  const M far = m_lt(v_set(SMALL_TURN * SMALL_TURN), turn * turn);
  V sine, cosine;
  v_sincos(x, &sine, &cosine);
  *s = v_select(far, sine, *s), *c = v_select(far, cosine, *c);
}

/* sin(x), cos(x) of x = base + turn, from s0 = sin(base), c0 = cos(base): half the work where the
   turn is small, as between the stages of a step. */
V_INLINE void v_sincos_turned(V x, V s0, V c0, V turn, V *s, V *c) {
  const V z = turn * turn;
  const V sine = v_fma(turn * z, v_fma(z, v_set(1.0 / 120), v_set(-1.0 / 6)), turn);
  const V tail = v_fma(z, v_set(-1.0 / 720), v_set(1.0 / 24));
  const V less = z * v_fma(z, tail, v_set(-0.5)); /* cos(turn) - 1 */
  *s = s0 + v_fma(c0, sine, s0 * less);
  *c = c0 + v_fma(-s0, sine, c0 * less);
  if (__builtin_expect(m_any(m_lt(v_set(SMALL_TURN * SMALL_TURN), z)), 0))
    v_sincos_far(x, turn, s, c);
}

#endif
