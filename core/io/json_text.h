#pragma once

#include <string>

namespace atelier {

/// JSON as it is printed: names of files may be any bytes, and what is no UTF-8 in them is replaced
/// by U+FFFD. @param json  an nlohmann::json or ordered_json: include <nlohmann/json.hpp> in the
/// .cpp that calls this. @param indent  spaces; -1: all in one line
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace atelier
