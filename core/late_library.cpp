#include "core/late_library.h"

#include <dlfcn.h>

#include "core/error.h"

namespace atelier {
namespace {

const char* loader_complaint() {
  const char* text = dlerror();
  return text != nullptr ? text : "no reason given";
}

}  // namespace

void* late_symbol(const char* library, const char* function) {
  // Never closed: what it gave lives as long as the program.
  void* handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
  if (handle == nullptr) {
    throw EnvironmentError(library, loader_complaint());
  }
  void* symbol = dlsym(handle, function);
  if (symbol == nullptr) {
    throw EnvironmentError(library, loader_complaint());
  }
  return symbol;
}

}  // namespace atelier
