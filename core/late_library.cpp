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

/// Where the program's own are: lib/atelier of an installed prefix, lib of a build folder. Said in
/// full: a sanitizer stands between program and loader, which then looks into the sanitizer's run
/// path. The link says where the program really lies, through whichever links it was started.
std::filesystem::path beside_program(const char* library) {
  std::error_code none;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", none);
  const std::filesystem::path prefix = program.parent_path().parent_path();
  for (const std::filesystem::path& own :
       {prefix / "lib" / "atelier" / library, prefix / "lib" / library}) {
    if (std::filesystem::exists(own, none)) {
      return own;
    }
  }
  return library;  // a program that links the installed libraries has lib/atelier in its run path
}

}  // namespace

void* late_symbol(const char* library, const char* function) {
  // Never closed: what it gave lives as long as the program.
  void* handle = dlopen(beside_program(library).c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (handle == nullptr) {
    throw EnvironmentError(library, std::string("not loaded; it belongs in lib/atelier beside the "
                                                "program's bin: ") +
                                        loader_complaint());
  }
  void* symbol = dlsym(handle, function);
  if (symbol == nullptr) {
    throw EnvironmentError(library, loader_complaint());
  }
  return symbol;
}

}  // namespace atelier
