/* Elementary functions of all lanes at once.

   Those that a plant calls all the time are written out here, without a branch: a lane that is
   NaN or infinite delays no other. Their errors, in units of the spacing of doubles at the exact
   result (ulp), as tests/kernels/test_vector_math.py measures them:

     sin, cos, sincos   1.5 ulp    |x| <= 1e9; sane up to 1e15; beyond, anything within [-1, 1]
     tanh               2.5 ulp    every x; +-1 beyond 19.1
     exp                1.5 ulp    every x

   NaN gives NaN, sin and cos of infinity give NaN, -0 keeps its sign. The same bits come out in
   every width where the processor has fused multiply-add (ALIGHT_FUSED); where it has none, the
   C library's functions stand in. The rounding mode must be the usual one, to nearest.

   All other functions loop over lanes and call the C library: correct, portable and slow. */

#ifndef ALIGHT_VECTOR_MATH_H
#define ALIGHT_VECTOR_MATH_H

#include "vector.h"

/* Written by minimax.py, with the greatest relative error of each function so approximated. */
/* minimax begin */
#define TWO_OVER_PI 0x1.45f306dc9c883p-1
#define TWO_OVER_LN2 0x1.71547652b82fep+1
#define ONE_OVER_LN2 0x1.71547652b82fep+0
#define HALF_PI_0 0x1.921fb54442d18p+0
#define HALF_PI_1 0x1.1a62633145c07p-54
#define HALF_PI_2 -0x1.f1976b7ed8fbcp-110
#define HALF_LN2_0 0x1.62e42fefa39efp-2
#define HALF_LN2_1 0x1.abc9e3b39803fp-57
#define LN2_0 0x1.62e42fefa39efp-1
#define LN2_1 0x1.abc9e3b39803fp-56
/* sin r = r + r z P(z), |r| <= pi/4: 2^-57.0 */
#define SIN_0 -0x1.5555555555550p-3
#define SIN_1 0x1.1111111110248p-7
#define SIN_2 -0x1.a01a019d2a326p-13
#define SIN_3 0x1.71de3653457f8p-19
#define SIN_4 -0x1.ae5f026c908a7p-26
#define SIN_5 0x1.5dbc60f45f06bp-33
/* cos r = 1 - z/2 + z^2 P(z), |r| <= pi/4: 2^-63.9 */
#define COS_0 0x1.555555555554bp-5
#define COS_1 -0x1.6c16c16c15015p-10
#define COS_2 0x1.a01a019c8f251p-16
#define COS_3 -0x1.27e4f7f190f8ep-22
#define COS_4 0x1.1ee9dbce9d632p-29
#define COS_5 -0x1.8fa6843c3f820p-37
/* r coth r = 1 + z P(z), |r| <= (log 2)/4: 2^-60.0 */
#define COTH_0 0x1.555555555553ep-2
#define COTH_1 -0x1.6c16c16bebb95p-6
#define COTH_2 0x1.1566aaf1ea23ap-9
#define COTH_3 -0x1.bbd41b0a62ee4p-13
#define COTH_4 0x1.6375edce1527ap-16
/* exp r = 1 + r + r^2 P(r), |r| <= (log 2)/2: 2^-56.4 */
#define EXP_0 0x1.000000000000ap-1
#define EXP_1 0x1.55555555554fap-3
#define EXP_2 0x1.555555555089bp-5
#define EXP_3 0x1.1111111127cdep-7
#define EXP_4 0x1.6c16c184235d2p-10
#define EXP_5 0x1.a01a0129f0473p-13
#define EXP_6 0x1.a0199a1e9b858p-16
#define EXP_7 0x1.71df265eab721p-19
#define EXP_8 0x1.28ad6203815f8p-22
#define EXP_9 0x1.ad7d927219e0bp-26
/* minimax end */

#define V_FROM_LIBM_1(name)                                       \
  static __attribute__((noinline, unused)) V v_##name(V a) {      \
    V_EACH(i) a = v_put(a, i, name(v_get(a, i)));                 \
    return a;                                                     \
  }
#define V_FROM_LIBM_2(name)                                       \
  static __attribute__((noinline, unused)) V v_##name(V a, V b) { \
    V_EACH(i) a = v_put(a, i, name(v_get(a, i), v_get(b, i)));    \
    return a;                                                     \
  }

V_FROM_LIBM_1(tan)
V_FROM_LIBM_1(asin)
V_FROM_LIBM_1(acos)
V_FROM_LIBM_1(atan)
V_FROM_LIBM_1(sinh)
V_FROM_LIBM_1(cosh)
V_FROM_LIBM_1(asinh)
V_FROM_LIBM_1(acosh)
V_FROM_LIBM_1(atanh)
V_FROM_LIBM_1(log)
V_FROM_LIBM_1(log1p)
V_FROM_LIBM_1(expm1)
V_FROM_LIBM_1(erf)
V_FROM_LIBM_2(pow)
V_FROM_LIBM_2(atan2)
V_FROM_LIBM_2(fmod)
V_FROM_LIBM_2(remainder)
V_FROM_LIBM_2(hypot)

#if !ALIGHT_FUSED

V_FROM_LIBM_1(sin)
V_FROM_LIBM_1(cos)
V_FROM_LIBM_1(tanh)
V_FROM_LIBM_1(exp)
V_INLINE void v_sincos(V x, V *s, V *c) {
  *s = v_sin(x);
  *c = v_cos(x);
}

#else

/* Adding this to a number below 2^51 rounds that to an integer n: subtract it again for n as a
   double, or look at the lowest bits of the sum for n as an integer. */
#define ROUNDER 0x1.8p52

/* b0 + b1 x, of which polynomials are put together: a few dependent steps with powers of x, where
   Horner's scheme has one for every term. What is left of latency is the argument's reduction. */
V_INLINE V v_pair(V x, double b0, double b1) { return v_fma(x, v_set(b1), v_set(b0)); }

/* sin(x) and cos(x): r = x - n pi/2 in three steps, of which the first is exact as x and n pi/2
   agree in their leading digits. The last one, below the rounding of r unless r is tiny, stays
   off the critical path: only the leading term of the sine needs it. */
V_INLINE void v_sincos(V x, V *s, V *c) {
  const V shifted = v_fma(x, v_set(TWO_OVER_PI), v_set(ROUNDER));
  const I quadrant = v_bits(shifted);
  const V n = shifted - v_set(ROUNDER);
  const V r = v_fma(n, v_set(-HALF_PI_1), v_fma(n, v_set(-HALF_PI_0), x));
  const V leading = v_fma(n, v_set(-HALF_PI_2), r);

  const V z = r * r, z2 = z * z, z4 = z2 * z2;
  const V sin_tail = v_fma(z2, v_fma(z2, v_pair(z, SIN_4, SIN_5), v_pair(z, SIN_2, SIN_3)),
                           v_pair(z, SIN_0, SIN_1));
  const V cos_tail = v_fma(z4, v_fma(z2, v_set(COS_5), v_pair(z, COS_3, COS_4)),
                           v_fma(z2, v_pair(z, COS_1, COS_2), v_pair(z, -0.5, COS_0)));
  const V near_cos = v_fma(z, cos_tail, v_set(1.0));
  const V near_sin = v_or_sign(v_fma(r * z, sin_tail, leading), r); /* -0 else became 0 */

  /* A quarter turn per n: odd ones swap, every second one flips both signs. */
  const M odd = m_odd(quadrant);
  const I flip = quadrant << 62;
  /* An x so large that the reduction failed gives 0; NaN passes. */
  const M reduced = m_not(m_lt(v_set(1.0), z));
  *s = v_flip_where0(reduced, v_select(odd, near_cos, near_sin), flip);
  *c = v_flip_where0(reduced, v_negative_or(odd, near_sin, near_cos), flip);
}

V_INLINE V v_sin(V x) {
  V s, c;
  v_sincos(x, &s, &c);
  return s;
}

V_INLINE V v_cos(V x) {
  V s, c;
  v_sincos(x, &s, &c);
  return c;
}

/* tanh|x|, |x| = n h + r with h = (log 2)/2, by the addition theorem: tanh(n h) = (1 - w)/(1 + w)
   with w = 2^-n, tanh(r) = r/(1 + z P(z)) with z = r^2, and one division for both. Small terms
   are added up before large ones; for n = 0 nothing but r and 1 + z P(z) is left. */
V_INLINE V v_tanh(V x) {
  const V size = v_fabs(x);
  const V shifted = v_fma(size, v_set(TWO_OVER_LN2), v_set(ROUNDER));
  const V n = shifted - v_set(ROUNDER);
  const V w = v_of_bits((i_set(1023) - v_bits(shifted)) << 52);
  /* 1 + w and 1 - w; the latter falls short of 1 even where the former rounds to it. */
  const V more = v_set(1.0) + w, less = v_fma(w, v_set(-2.0), more);

  const V coarse = v_fma(n, v_set(-HALF_LN2_0), size);
  const V r = v_fma(n, v_set(-HALF_LN2_1), coarse);
  const V z = coarse * coarse, z2 = z * z; /* r itself would come later and change nothing */
  const V p = v_fma(z2, v_fma(z2, v_set(COTH_4), v_pair(z, COTH_2, COTH_3)),
                    v_pair(z, COTH_0, COTH_1));
  const V above = less + v_fma(r, more, p * (z * less));
  const V below = more + v_fma(r, less, p * (z * more));
  const M settled = m_lt(v_set(20.0), size); /* 1, where n may be too large for w */
  return v_copysign(v_divide_or(m_not(settled), above, below, v_set(1.0)), x);
}

/* 2^n for the integer n in the lowest bits of `shifted`. */
V_INLINE V v_power_of_two(V shifted) {
  return v_of_bits((v_bits(shifted) + i_set(1023)) << 52);
}

/* exp(x) = 2^n exp(r), r = x - n log 2. */
V_INLINE V v_exp(V x) {
  const V shifted = v_fma(x, v_set(ONE_OVER_LN2), v_set(ROUNDER));
  const V n = shifted - v_set(ROUNDER);
  const V r = v_fma(n, v_set(-LN2_1), v_fma(n, v_set(-LN2_0), x));
  const V r2 = r * r, r4 = r2 * r2;
  const V low = v_fma(r2, v_pair(r, EXP_2, EXP_3), v_pair(r, EXP_0, EXP_1));
  const V high = v_fma(r4, v_pair(r, EXP_8, EXP_9),
                       v_fma(r2, v_pair(r, EXP_6, EXP_7), v_pair(r, EXP_4, EXP_5)));
  const V y = v_fma(r2, v_fma(r4, high, low), v_set(1.0) + r);
#if ALIGHT_AVX512
  const V scaled = _mm512_scalef_pd(y, n);
#else
  /* In two steps, as 2^n itself may be no normal number; only the second one can round. */
  const V half = v_fma(n, v_set(0.5), v_set(ROUNDER));
  const V rest = n - (half - v_set(ROUNDER)) + v_set(ROUNDER);
  const V scaled = y * v_power_of_two(half) * v_power_of_two(rest);
#endif
  /* Far outside of the range of results nothing above holds; NaN passes both tests. */
  const V floored = v_where0(m_not(m_lt(x, v_set(-746.0))), scaled);
  return v_select(m_lt(v_set(710.0), x), v_set(HUGE_VAL), floored);
}

#endif

#endif
