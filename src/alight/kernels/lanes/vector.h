/* LANES runs side by side: a vector V of doubles, a mask M, and what code is written with.

   Arithmetic is written `a + b`, `a - b`, `a * b`, `a / b`, `-a`: V is double or a vector type of
   the compiler. Lanes never mix, and every operation rounds as IEEE 754 says, so a lane's result
   depends neither on its neighbours nor on LANES. With -ffp-contract=fast (GCC's default, not
   Clang's) `a * b + c` is contracted in every width; where the bits matter, v_fma says so.

   The width is the widest that the compiler may use (8 with AVX-512, 4 with AVX2, 2 on AArch64,
   otherwise 1). -DALIGHT_LANES=1|2|4|8 overrides it: a width which the processor lacks is put
   together by the compiler from narrower registers, correct and slow. Needs GCC >= 9 or Clang. */

#ifndef ALIGHT_VECTOR_H
#define ALIGHT_VECTOR_H

#include <math.h>
#include <stdint.h>

#ifdef __FAST_MATH__
#error "-ffast-math removes the NaN tests and the exact reductions that this file relies on"
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#define ALIGHT_NATIVE_LANES 8
#elif defined(__AVX2__) && defined(__FMA__)
#define ALIGHT_NATIVE_LANES 4
#elif defined(__aarch64__)
#define ALIGHT_NATIVE_LANES 2
#else
#define ALIGHT_NATIVE_LANES 1
#endif

#ifdef ALIGHT_LANES
#define LANES ALIGHT_LANES
#else
#define LANES ALIGHT_NATIVE_LANES
#endif

/* Instruction set in use; a width without one is left to the compiler. */
#if LANES == 8 && ALIGHT_NATIVE_LANES == 8
#define ALIGHT_AVX512 1
#elif LANES == 4 && defined(__AVX2__) && defined(__FMA__)
#define ALIGHT_AVX2 1
#elif LANES == 2 && defined(__aarch64__)
#define ALIGHT_NEON 1
#elif LANES == 1
#define ALIGHT_SCALAR 1
#elif LANES == 2 || LANES == 4 || LANES == 8
#define ALIGHT_GENERIC 1
#else
#error "ALIGHT_LANES must be 1, 2, 4 or 8"
#endif

/* Without hardware for it a fused multiply-add costs a call each; v_fma then rounds twice. */
#if defined(__FMA__) || defined(__aarch64__) || defined(FP_FAST_FMA)
#define ALIGHT_FUSED 1
#else
#define ALIGHT_FUSED 0
#endif

#if ALIGHT_AVX512 || ALIGHT_AVX2
#include <immintrin.h>
#elif ALIGHT_NEON
#include <arm_neon.h>
#endif

#if !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi" /* on calling conventions: all calls are inlined */
#endif

#define V_INLINE static inline __attribute__((always_inline, unused))
#define V_EACH(i) for (int i = 0; i < LANES; ++i)

/* ---- Types: V, the integers I of its bit patterns, the mask M -------------------------------- */

#if ALIGHT_SCALAR
typedef double V;
typedef uint64_t I;
typedef int M; /* 0 or 1 */
#elif ALIGHT_NEON
typedef float64x2_t V;
typedef uint64x2_t I;
typedef uint64x2_t M; /* all bits of a lane, or none; also below */
#else
typedef double V __attribute__((vector_size(8 * LANES), may_alias));
typedef unsigned long long I __attribute__((vector_size(8 * LANES), may_alias));
#if ALIGHT_AVX512
typedef __mmask8 M; /* one bit per lane */
#else
typedef long long M __attribute__((vector_size(8 * LANES), may_alias));
#endif
#endif

/* ---- Making, loading, storing ---------------------------------------------------------------- */

#if LANES == 1
#define V_REPEAT(c) (c)
#elif LANES == 2
#define V_REPEAT(c) {(c), (c)}
#elif LANES == 4
#define V_REPEAT(c) {(c), (c), (c), (c)}
#else
#define V_REPEAT(c) {(c), (c), (c), (c), (c), (c), (c), (c)}
#endif

V_INLINE V v_set(double c) {
  const V v = V_REPEAT(c);
  return v;
}

V_INLINE I i_set(uint64_t c) {
  const I i = V_REPEAT(c);
  return i;
}

/* `p` is aligned to the size of a V. */
V_INLINE V v_load(const double *p) { return *(const V *)p; }
V_INLINE void v_store(double *p, V a) { *(V *)p = a; }

V_INLINE double v_get(V a, int lane) {
#if ALIGHT_SCALAR
  (void)lane;
  return a;
#else
  return a[lane];
#endif
}

V_INLINE V v_put(V a, int lane, double value) {
#if ALIGHT_SCALAR
  (void)lane;
  a = value;
#else
  a[lane] = value;
#endif
  return a;
}

/* ---- Bit patterns ---------------------------------------------------------------------------- */

#if ALIGHT_SCALAR
V_INLINE I v_bits(V a) {
  I i;
  __builtin_memcpy(&i, &a, sizeof i);
  return i;
}
V_INLINE V v_of_bits(I i) {
  V a;
  __builtin_memcpy(&a, &i, sizeof a);
  return a;
}
#else
V_INLINE I v_bits(V a) { return (I)a; }
V_INLINE V v_of_bits(I i) { return (V)i; }
#endif

#define V_SIGN_BIT (UINT64_C(1) << 63)

#if ALIGHT_AVX512
#define V_TERNARY(a, b, c, table) \
  ((V)_mm512_ternarylogic_epi64((__m512i)(a), (__m512i)(b), (__m512i)(c), table))
#define V_OR_OF_AND 0xf8  /* a | (b & c), as AVX-512 writes it */
#define V_XOR_OF_AND 0x78 /* a ^ (b & c) */
#define V_BY_BIT 0xca     /* a ? b : c */
#endif

V_INLINE V v_fabs(V a) {
#if ALIGHT_AVX512
  return (V)_mm512_andnot_si512((__m512i)i_set(V_SIGN_BIT), (__m512i)a);
#else
  return v_of_bits(v_bits(a) & i_set(~V_SIGN_BIT));
#endif
}

/* Magnitude of `a`, sign of `b`. */
V_INLINE V v_copysign(V a, V b) {
#if ALIGHT_AVX512
  return V_TERNARY(i_set(V_SIGN_BIT), b, a, V_BY_BIT);
#else
  return v_of_bits((v_bits(a) & i_set(~V_SIGN_BIT)) | (v_bits(b) & i_set(V_SIGN_BIT)));
#endif
}

/* `a`, made negative where `b` is. */
V_INLINE V v_or_sign(V a, V b) {
#if ALIGHT_AVX512
  return V_TERNARY(a, b, i_set(V_SIGN_BIT), V_OR_OF_AND);
#else
  return v_of_bits(v_bits(a) | (v_bits(b) & i_set(V_SIGN_BIT)));
#endif
}

/* ---- Arithmetic that has no operator --------------------------------------------------------- */

/* a * b + c, rounded once (ALIGHT_FUSED). */
V_INLINE V v_fma(V a, V b, V c) {
#if !ALIGHT_FUSED
  return a * b + c;
#elif ALIGHT_AVX512
  return _mm512_fmadd_pd(a, b, c);
#elif ALIGHT_AVX2
  return _mm256_fmadd_pd(a, b, c);
#elif ALIGHT_NEON
  return vfmaq_f64(c, a, b);
#elif ALIGHT_SCALAR
  return __builtin_fma(a, b, c);
#else
  V_EACH(i) c[i] = __builtin_fma(a[i], b[i], c[i]);
  return c;
#endif
}

#if ALIGHT_AVX512
V_INLINE V v_sqrt(V a) { return _mm512_sqrt_pd(a); }
V_INLINE V v_floor(V a) { return _mm512_roundscale_pd(a, _MM_FROUND_TO_NEG_INF); }
V_INLINE V v_ceil(V a) { return _mm512_roundscale_pd(a, _MM_FROUND_TO_POS_INF); }
V_INLINE V v_rint(V a) { return _mm512_roundscale_pd(a, _MM_FROUND_TO_NEAREST_INT); }
#elif ALIGHT_AVX2
V_INLINE V v_sqrt(V a) { return _mm256_sqrt_pd(a); }
V_INLINE V v_floor(V a) { return _mm256_floor_pd(a); }
V_INLINE V v_ceil(V a) { return _mm256_ceil_pd(a); }
V_INLINE V v_rint(V a) { return _mm256_round_pd(a, _MM_FROUND_TO_NEAREST_INT); }
#elif ALIGHT_NEON
V_INLINE V v_sqrt(V a) { return vsqrtq_f64(a); }
V_INLINE V v_floor(V a) { return vrndmq_f64(a); }
V_INLINE V v_ceil(V a) { return vrndpq_f64(a); }
V_INLINE V v_rint(V a) { return vrndnq_f64(a); }
#elif ALIGHT_SCALAR
V_INLINE V v_sqrt(V a) { return __builtin_sqrt(a); }
V_INLINE V v_floor(V a) { return __builtin_floor(a); }
V_INLINE V v_ceil(V a) { return __builtin_ceil(a); }
V_INLINE V v_rint(V a) { return __builtin_rint(a); }
#else
#define V_BY_LANE(name)                      \
  V_INLINE V v_##name(V a) {                 \
    V_EACH(i) a[i] = __builtin_##name(a[i]); \
    return a;                                \
  }
V_BY_LANE(sqrt)
V_BY_LANE(floor)
V_BY_LANE(ceil)
V_BY_LANE(rint)
#undef V_BY_LANE
#endif

/* ---- Comparisons: false if an operand is NaN, but m_ne then is true -------------------------- */

#if ALIGHT_AVX512
V_INLINE M m_lt(V a, V b) { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); }
V_INLINE M m_le(V a, V b) { return _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ); }
V_INLINE M m_eq(V a, V b) { return _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ); }
V_INLINE M m_ne(V a, V b) { return _mm512_cmp_pd_mask(a, b, _CMP_NEQ_UQ); }
#elif ALIGHT_NEON
V_INLINE M m_lt(V a, V b) { return vcltq_f64(a, b); }
V_INLINE M m_le(V a, V b) { return vcleq_f64(a, b); }
V_INLINE M m_eq(V a, V b) { return vceqq_f64(a, b); }
V_INLINE M m_ne(V a, V b) { return ~vceqq_f64(a, b); }
#else
V_INLINE M m_lt(V a, V b) { return a < b; }
V_INLINE M m_le(V a, V b) { return a <= b; }
V_INLINE M m_eq(V a, V b) { return a == b; }
V_INLINE M m_ne(V a, V b) { return a != b; }
#endif

V_INLINE M m_and(M a, M b) { return (M)(a & b); }
V_INLINE M m_or(M a, M b) { return (M)(a | b); }
#if ALIGHT_SCALAR
V_INLINE M m_not(M m) { return !m; }
#else
V_INLINE M m_not(M m) { return (M)~m; }
#endif

/* ---- Masks and values ------------------------------------------------------------------------ */

/* `yes` where m, otherwise `no`. */
V_INLINE V v_select(M m, V yes, V no) {
#if ALIGHT_AVX512
  return _mm512_mask_blend_pd(m, no, yes);
#elif ALIGHT_AVX2
  return _mm256_blendv_pd(no, yes, (V)m);
#elif ALIGHT_NEON
  return vbslq_f64(m, yes, no);
#elif ALIGHT_SCALAR
  return m ? yes : no;
#else
  return (V)(((M)yes & m) | ((M)no & ~m));
#endif
}

/* -`yes` where m, otherwise `no`. */
V_INLINE V v_negative_or(M m, V yes, V no) {
#if ALIGHT_AVX512
  return _mm512_mask_xor_pd(no, m, yes, v_set(-0.0));
#else
  return v_select(m, -yes, no);
#endif
}

/* yes / by where m, otherwise `no`. */
V_INLINE V v_divide_or(M m, V yes, V by, V no) {
#if ALIGHT_AVX512
  return _mm512_mask_div_pd(no, m, yes, by);
#else
  return v_select(m, yes / by, no);
#endif
}

/* `a` where m, otherwise 0 (whatever `a` is, NaN included). */
V_INLINE V v_where0(M m, V a) {
#if ALIGHT_AVX512
  return _mm512_maskz_mov_pd(m, a);
#elif ALIGHT_SCALAR
  return m ? a : 0.0;
#else
  return (V)((M)a & m);
#endif
}

/* The same with the sign of `a` flipped where `pattern` is negative. */
V_INLINE V v_flip_where0(M m, V a, I pattern) {
#if ALIGHT_AVX512
  return (V)_mm512_maskz_ternarylogic_epi64(m, (__m512i)a, (__m512i)pattern,
                                            (__m512i)i_set(V_SIGN_BIT), V_XOR_OF_AND);
#else
  return v_where0(m, v_of_bits(v_bits(a) ^ (pattern & i_set(V_SIGN_BIT))));
#endif
}

/* 1 where m, otherwise 0. */
V_INLINE V v_from_mask(M m) { return v_where0(m, v_set(1.0)); }

/* a != 0 (true for NaN, as in C). */
V_INLINE M m_from_value(V a) { return m_ne(a, v_set(0.0)); }

/* Where the lowest bit of an integer is set. */
V_INLINE M m_odd(I i) {
#if ALIGHT_AVX512
  return _mm512_test_epi64_mask((__m512i)i, (__m512i)i_set(1));
#elif ALIGHT_NEON
  return vtstq_u64(i, i_set(1));
#elif ALIGHT_SCALAR
  return (M)(i & 1);
#else
  return -(M)(i & 1);
#endif
}

/* Bit i is lane i. */
V_INLINE unsigned m_bits(M m) {
#if ALIGHT_AVX512 || ALIGHT_SCALAR
  return (unsigned)m;
#elif ALIGHT_AVX2
  return (unsigned)_mm256_movemask_pd((V)m);
#else
  unsigned bits = 0;
  V_EACH(i) bits |= (unsigned)(m[i] & 1) << i;
  return bits;
#endif
}

#define M_ALL_BITS ((1u << LANES) - 1u)

V_INLINE int m_any(M m) { return m_bits(m) != 0; }
V_INLINE int m_all(M m) { return m_bits(m) == M_ALL_BITS; }

/* First lane of a mask, LANES if there is none. */
V_INLINE int m_first(M m) { return __builtin_ctz(m_bits(m) | (1u << LANES)); }

/* The mask whose lane i is bit i. */
V_INLINE M m_from_bits(unsigned bits) {
#if ALIGHT_AVX512 || ALIGHT_SCALAR
  return (M)(bits & M_ALL_BITS);
#else
  V a = v_set(0.0);
  V_EACH(i) a[i] = (bits >> i) & 1;
  return m_from_value(a);
#endif
}

/* ---- What follows from them ------------------------------------------------------------------ */

/* The smaller and the larger operand; the second one if either is NaN or both are equal. */
#if ALIGHT_AVX512
V_INLINE V v_min(V a, V b) { return _mm512_min_pd(a, b); }
V_INLINE V v_max(V a, V b) { return _mm512_max_pd(a, b); }
#elif ALIGHT_AVX2
V_INLINE V v_min(V a, V b) { return _mm256_min_pd(a, b); }
V_INLINE V v_max(V a, V b) { return _mm256_max_pd(a, b); }
#else
V_INLINE V v_min(V a, V b) { return v_select(m_lt(a, b), a, b); }
V_INLINE V v_max(V a, V b) { return v_select(m_lt(b, a), a, b); }
#endif

/* -1, 1, or the argument itself where that is 0 or NaN. */
V_INLINE V v_sign(V a) {
  return v_select(m_lt(v_set(0.0), v_fabs(a)), v_copysign(v_set(1.0), a), a);
}

#endif
