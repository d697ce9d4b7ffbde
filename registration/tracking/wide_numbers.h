#pragma once

namespace atelier {

/// Several numbers that are worked on at once, by the compiler's vector types: with AVX2 one
/// register, without it two. Loops over them are written once, inline, and compiled twice: with
/// `__attribute__((target("avx2,fma")))` and without, which one being chosen at run time.
using FourDoubles [[gnu::vector_size(32), gnu::aligned(8), gnu::may_alias]] = double;
using EightFloats [[gnu::vector_size(32), gnu::aligned(4), gnu::may_alias]] = float;

/// Whether this processor has AVX2 and FMA.
inline bool has_avx2() {
#ifdef __x86_64__
  static const bool has = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  return has;
#else
  return false;
#endif
}

}  // namespace atelier

#ifdef __x86_64__
#define ATELIER_AVX2 __attribute__((target("avx2,fma")))
#else
#define ATELIER_AVX2
#endif
