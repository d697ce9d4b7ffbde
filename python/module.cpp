#include "python/bindings.h"

PYBIND11_MODULE(_atelier, module) {
  using namespace atelier::python;
  module.doc() = "Bindings of Atelier's C++ libraries; use the package atelier.";
  module.attr("__version__") = ATELIER_VERSION;
  bind_errors();
  bind_options(module);
  bind_core(module);
  bind_files(module);
  bind_body(module);
  bind_capture(module);
  bind_pattern(module);
  bind_cloth(module);
  bind_render(module);
  bind_workspace(module);
  bind_bench(module);
}
