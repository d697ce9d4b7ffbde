#include "core/store/build_info.h"

#include "core/device.h"

namespace atelier {

std::string build_info() {
#ifdef ATELIER_VERSION
  std::string text = "atelier " ATELIER_VERSION;
#else
  std::string text = "atelier";
#endif
#if defined(__clang__)
  text += ", clang " __clang_version__;
#elif defined(__GNUC__)
  text += ", gcc " __VERSION__;
#endif
#ifdef __OPTIMIZE__
  text += ", optimised";
#else
  text += ", not optimised";
#endif
#ifdef ATELIER_HAS_CUDA
  text += ", CUDA";
#endif
  return text;
}

}  // namespace atelier
