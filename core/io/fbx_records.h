#pragma once

// Behind fbx_import.h: the records of an FBX file, binary or text, for what libassimp reads and
// does not hand on. Only core/io includes this.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace atelier {

/// A number or a text.
struct FbxValue {
  double number = 0;
  std::int64_t integer = 0;  ///< the same as a whole number, where it is one: identities
  std::string_view text;     ///< into the file
  bool is_text = false;
};

/// `Name: value, value, ...`; an array of numbers is so many values.
struct FbxRecord {
  std::string_view name;
  std::vector<FbxValue> values;
};

/// The records of these names in the order of the file, whatever they are part of; a record comes
/// before those that it holds. Of one record come at most 1,048,576 values, of a compressed array
/// none. Nothing is thrown: libassimp has said before whether a file is sound, and
/// reading ends where this cannot follow. O(bytes of text, records of binary).
void read_fbx_records(std::span<const std::byte> bytes, std::span<const std::string_view> names,
                      const std::function<void(const FbxRecord&)>& on_record);

/// The name of an object: "Model::arm" in text, "arm\0\1Model" in binary.
std::string_view fbx_object_name(std::string_view text);

}  // namespace atelier
