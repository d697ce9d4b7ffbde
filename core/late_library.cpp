#include "core/late_library.h"

#include <filesystem>
#include <string>
#include <system_error>

#include <dlfcn.h>

#include "core/error.h"

namespace atelier {
namespace {

const char* loader_complaint() {
  const char* text = dlerror();
  return text != nullptr ? text : "no reason given";
}

/// Where the program's own are. Said in full: a sanitizer stands between program and loader, which
/// then looks into the sanitizer's run path.
std::filesystem::path beside_program(const char* library) {
  std::error_code none;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", none);
  const std::filesystem::path own = program.parent_path().parent_path() / "lib" / library;
  return std::filesystem::exists(own, none) ? own : std::filesystem::path(library);
}

}  // namespace

void* late_symbol(const char* library, const char* function) {
  // Never closed: what it gave lives as long as the program.
  void* handle = dlopen(beside_program(library).c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (handle == nullptr) {
    throw EnvironmentError(library, std::string("not loaded; it belongs into the folder lib beside "
                                                "the program's bin: ") +
                                        loader_complaint());
  }
  void* symbol = dlsym(handle, function);
  if (symbol == nullptr) {
    throw EnvironmentError(library, loader_complaint());
  }
  return symbol;
}

}  // namespace atelier
