#include "pipeline/inspection/inspection.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "core/printable.h"

namespace atelier {
namespace {

std::string text_of_value(const nlohmann::ordered_json& value) {
  if (value.is_string()) {
    return value.get<std::string>();
  }
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value.get<double>());
    return text;
  }
  std::string text;
  if (value.is_array()) {
    for (const auto& item : value) {
      text += (text.empty() ? "" : " ") + text_of_value(item);
    }
    return text;
  }
  if (value.is_object()) {
    if (value.contains("shape")) {
      text = value["type"].get<std::string>() + " " + value["shape"].dump();
      text += value.contains("least")
                  ? ", " + text_of_value(value["least"]) + " to " + text_of_value(value["most"])
                  : "";
      return text + (value.contains("not_finite")
                         ? ", " + value["not_finite"].dump() + " not finite"
                         : "");
    }
    for (const auto& item : value.items()) {
      text += (text.empty() ? "" : ", ") + item.key() + " " + text_of_value(item.value());
    }
    return text;
  }
  return value.is_null() ? "none" : value.dump();
}

std::string line_of(const Inspection::Fact& fact, const std::string& indent) {
  constexpr std::size_t kColumn = 18;
  std::string column = indent + printable(fact.name);
  column.resize(std::max(column.size() + 2, kColumn), ' ');
  return column + printable(text_of_value(fact.value)) +
         (fact.unit.empty() || fact.value.is_null() ? "" : " " + fact.unit) + "\n";
}

std::string key_of(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

/// "[3,1]" of the element `at` in the order of the file.
std::string place_text(std::int64_t at, const std::vector<std::int64_t>& shape) {
  std::vector<std::int64_t> place(shape.size());
  for (std::size_t d = shape.size(); d-- > 0;) {
    place[d] = at % shape[d];
    at /= shape[d];
  }
  return shape_text(place);
}

bool is_complex(ElementType type) {
  return type == ElementType::Complex64 || type == ElementType::Complex128;
}

/// Complex numbers, [...,2]: their real and imaginary parts.
Tensor parts_of(const Tensor& tensor) {
  Tensor parts = tensor;
  parts.type = tensor.type == ElementType::Complex64 ? ElementType::Float32 : ElementType::Float64;
  parts.shape.push_back(2);
  return parts;
}

/// Type and shape of an array and, of numbers, the range and how many are not finite.
nlohmann::ordered_json tensor_facts(const Tensor& tensor, std::int64_t& first_not_finite) {
  nlohmann::ordered_json facts = {{"type", element_type_name(tensor.type)},
                                  {"shape", tensor.shape}};
  if (tensor.type == ElementType::Text) {
    return facts;
  }
  if (is_complex(tensor.type)) {
    const std::vector<double> parts = doubles_of(parts_of(tensor));
    std::int64_t count = 0;
    for (std::size_t i = 0; i < parts.size(); i += 2) {
      if (!std::isfinite(parts[i]) || !std::isfinite(parts[i + 1])) {
        first_not_finite = count == 0 ? static_cast<std::int64_t>(i / 2) : first_not_finite;
        ++count;
      }
    }
    if (count > 0) {
      facts["not_finite"] = count;
    }
    return facts;
  }
  double least = 0;
  double most = 0;
  std::int64_t finite = 0;
  const std::vector<double> values = doubles_of(tensor);
  for (const double& value : values) {
    if (std::isfinite(value)) {
      least = finite == 0 ? value : std::min(least, value);
      most = finite == 0 ? value : std::max(most, value);
      ++finite;
    } else if (first_not_finite < 0) {
      first_not_finite = &value - values.data();
    }
  }
  if (finite > 0) {
    facts["least"] = least;
    facts["most"] = most;
  }
  if (const auto rest = std::ssize(values) - finite; rest > 0) {
    facts["not_finite"] = rest;
  }
  return facts;
}

}  // namespace

void add_array(const std::string& name, const Tensor& tensor, Inspection& inspection) {
  std::int64_t first = -1;
  inspection.add_member(name, tensor_facts(tensor, first));
  if (first >= 0) {
    inspection.findings.push_back(
        {Severity::Warning, "not-finite",
         name + (tensor.shape.empty() ? "" : place_text(first, tensor.shape)),
         "the first of its numbers that are not finite",
         "the program that wrote it divided by zero or left values out; most readers refuse such "
         "numbers"});
  }
}

void add_stated_consent(const std::vector<Consent>& consent, const std::filesystem::path& place,
                        Inspection& inspection) {
  inspection.add("consent", to_string(consent));
  for (const std::string& sentence :
       ended_consent(consent, static_cast<double>(std::time(nullptr)))) {
    inspection.findings.push_back({Severity::Warning, "consent-ended", place.string(), sentence,
                                   "renew the consent, or remove the capture"});
  }
}

nlohmann::ordered_json json_of(const Inspection& inspection) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  nlohmann::ordered_json units = nlohmann::ordered_json::object();
  for (const Inspection::Fact& fact : inspection.facts) {
    json[key_of(fact.name)] = fact.value;
    if (!fact.unit.empty()) {
      units[key_of(fact.name)] = fact.unit;
    }
  }
  if (!units.empty()) {
    json["units"] = units;
  }
  if (!inspection.members.empty()) {
    json["members"] = nlohmann::ordered_json::object();
    for (const Inspection::Fact& member : inspection.members) {
      json["members"][member.name] = member.value;
    }
  }
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& finding : inspection.findings) {
    json["findings"].push_back({{"severity", severity_name(finding.severity)},
                                {"code", finding.code},
                                {"place", finding.place},
                                {"what", finding.what},
                                {"advice", finding.advice}});
  }
  return json;
}

std::string text_of(const Inspection& inspection) {
  std::string text;
  for (const Inspection::Fact& fact : inspection.facts) {
    text += line_of(fact, "");
  }
  for (const Inspection::Fact& member : inspection.members) {
    text += line_of(member, "  ");
  }
  for (const Finding& finding : inspection.findings) {
    text += printable(to_string(finding)) + "\n";
  }
  return text;
}

}  // namespace atelier
