#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/io/npz.h"
#include "core/io/safetensors.h"

namespace atelier::fuzz {

/// A body's arrays: an npz itself, or the numbers of a safetensors file with the names that such a
/// file cannot hold: an npz has checksums, behind which damage seldom comes as far as the reader of
/// the arrays. @param names  lists of words beside those of every body
inline Npz body_npz(std::span<const std::byte> bytes,
                    std::map<std::string, std::vector<std::string>> names = {}) {
  if (bytes.size() >= 2 && bytes[0] == std::byte{'P'} && bytes[1] == std::byte{'K'}) {
    return Npz({bytes.begin(), bytes.end()}, "body.npz");
  }
  std::map<std::string, Tensor> arrays = parse_safetensors(bytes, "body.npz").tensors;
  // A zip takes no empty name, and no reader asks for one that is not of small letters.
  std::erase_if(arrays, [](const auto& one) {
    return one.first.empty() ||
           one.first.find_first_not_of("abcdefghijklmnopqrstuvwxyz_") != std::string::npos;
  });
  names.insert({{"schema", {arrays.contains("fps") ? "atelier-motion-1" : "atelier-body-1"}},
                {"name", {"small"}},
                {"unit", {"m"}},
                {"up", {"y"}},
                {"joint_names", {"hips", "chest"}},
                {"shape_names", {"stature"}},
                {"shape_units", {"m"}},
                {"group_names", {"front"}}});
  for (auto& [name, words] : names) {
    Tensor tensor{ElementType::Text, {static_cast<std::int64_t>(words.size())}, {}, {}};
    tensor.strings = std::move(words);
    arrays.try_emplace(name, std::move(tensor));
  }
  return Npz(npz_bytes(arrays, false), "body.npz");
}

}  // namespace atelier::fuzz
