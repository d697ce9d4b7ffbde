#include "python/options.h"

#include <map>
#include <vector>

#include "core/usage_error.h"
#include "python/arrays.h"
#include "python/bindings.h"

namespace atelier::python {
namespace {

using Makers = std::vector<std::pair<std::string, OptionSet (*)()>>;

Makers& makers() {
  static Makers all;
  return all;
}

/// As `set_option` reads it.
std::string text_of(py::handle value) {
  if (py::isinstance<py::bool_>(value)) {
    return value.cast<bool>() ? "true" : "false";
  }
  if (py::isinstance<py::str>(value)) {
    return value.cast<std::string>();
  }
  if (py::hasattr(value, "tolist")) {  // numbers and arrays of NumPy
    return text_of(value.attr("tolist")());
  }
  if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
    std::string text;
    for (const py::handle element : value) {
      text += (text.empty() ? "" : ", ") + text_of(element);
    }
    return "[" + text + "]";
  }
  if (py::hasattr(value, "__fspath__")) {
    return py::str(value).cast<std::string>();
  }
  return py::repr(value).cast<std::string>();
}

void set_all(OptionTable& table, const std::string& prefix, const py::dict& values,
             std::vector<std::string>& problems) {
  for (const auto& [key, value] : values) {
    const std::string name = prefix + py::str(key).cast<std::string>();
    if (py::isinstance<py::dict>(value)) {
      set_all(table, name + ".", value.cast<py::dict>(), problems);
    } else if (!value.is_none()) {
      std::string problem = set_option(table, name, text_of(value), "python");
      if (!problem.empty()) {
        problems.push_back(std::move(problem));
      }
    }
  }
}

py::object value_of(const OptionField& field) {
  return std::visit(
      [&](const auto& target) -> py::object {
        using Target = std::remove_cvref_t<decltype(target)>;
        if constexpr (std::is_same_v<Target, OptionEnum>) {
          return py::str(option_text(field));
        } else if constexpr (std::is_same_v<Target, std::vector<double>*>) {
          py::list list;
          for (const double number : *target) {
            list.append(number);
          }
          return list;
        } else {
          return py::cast(*target);
        }
      },
      field.target);
}

const char* type_name(const OptionField& field) {
  constexpr const char* kNames[] = {"bool", "int", "int", "float", "str", "list[float]", "str"};
  return kNames[field.target.index()];
}

py::list fields_of(const OptionTable& table) {
  py::list fields;
  for (const OptionField& field : table.fields) {
    py::dict one;
    one["name"] = field.name;
    one["type"] = type_name(field);
    one["default"] = value_of(field);
    one["help"] = field.help;
    one["unit"] = field.unit;
    one["range"] = option_range(field);
    one["choices"] = py::cast(field.choices);
    fields.append(one);
  }
  return fields;
}

}  // namespace

void set_options(OptionTable table, py::handle given) {
  if (given.is_none()) {
    return;
  }
  const py::object values = py::hasattr(given, "to_dict")
                                ? given.attr("to_dict")()
                                : py::reinterpret_borrow<py::object>(given);
  if (!py::isinstance<py::dict>(values)) {
    throw UsageError("options cannot be of type " +
                     py::str(py::type::handle_of(given).attr("__name__")).cast<std::string>() +
                     ": they are a dataclass of options, a dict, or None for the defaults");
  }
  std::vector<std::string> problems;
  set_all(table, "", values.cast<py::dict>(), problems);
  if (!problems.empty()) {
    throw UsageError(problems);
  }
}

py::dict options_dict(const OptionTable& table) {
  py::dict all;
  for (const OptionField& field : table.fields) {
    py::dict at = all;
    std::string name = field.name;
    for (std::size_t dot = name.find('.'); dot != std::string::npos; dot = name.find('.')) {
      const py::str group(name.substr(0, dot));
      if (!at.contains(group)) {
        at[group] = py::dict();
      }
      at = at[group].cast<py::dict>();
      name.erase(0, dot + 1);
    }
    at[py::str(name)] = value_of(field);
  }
  return all;
}

py::object options_object(const std::string& name, const OptionTable& table) {
  return py::module_::import("atelier").attr(name.c_str()).attr("from_dict")(options_dict(table));
}

void add_options_class(const std::string& name, OptionSet (*defaults)()) {
  makers().emplace_back(name, defaults);
}

void bind_options(py::module_& module) {
  module.def("_options_classes", [] {
    py::dict classes;
    for (const auto& [name, defaults] : makers()) {
      classes[py::str(name)] = fields_of(defaults().table);
    }
    return classes;
  });
  module.def("_check_options", [](const std::string& name, const py::dict& values) {
    for (const auto& [known, defaults] : makers()) {
      if (known == name) {
        set_options(defaults().table, values);
      }
    }
  });
}

}  // namespace atelier::python
