#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.h"

namespace atelier {

/// Numbers or texts, as USD's arrays and single values have them.
struct UsdValue {
  std::vector<double> numbers;     ///< of vectors and matrices one behind the other, by rows
  std::vector<std::string> texts;  ///< tokens and strings
};

/// An attribute of a prim.
struct UsdAttribute {
  bool has_value = false;
  UsdValue value;                 ///< the default, where there is one
  std::vector<double> times;      ///< time codes of the samples, increasing
  std::vector<UsdValue> samples;  ///< one for each
  std::string interpolation;      ///< of a primvar, or ""
};

struct UsdPrim {
  std::string name;
  std::string type;      ///< "Mesh", "Xform", ...
  int parent = -1;       ///< prims stand behind their parents
  bool defined = false;  ///< def, not over or class, and active
  bool refers = false;   ///< to another file or prim: references, payloads, variants, inherits
  bool skinned = false;  ///< by a skeleton of UsdSkel
  std::map<std::string, UsdAttribute> attributes;  ///< those of meshes and their places
};

/// One layer of USD as plain data: prims with what meshes are made of.
struct UsdStage {
  double metres_per_unit = 0.01;  ///< USD's own default
  char up = 'y';
  double fps = 24;         ///< time codes a second
  bool sublayers = false;  ///< the layer names others, which are not read
  std::vector<UsdPrim> prims;
};

/// Whether an attribute is kept: points, faces, uvs, transforms and what hides a mesh.
bool is_usd_mesh_attribute(const std::string& name);

/// Reads binary USD ("PXR-USDC", crate versions 0.4 to 0.13; OpenUSD, pxr/usd/usd/crateFile.cpp):
/// sections, LZ4, integer coding, inlined values, time samples. Throws DataError, with the byte or
/// the section, for anything that is no such file, is damaged, or claims more than its bytes and
/// `limits` pay for.
UsdStage read_usd_crate(std::span<const std::byte> bytes, const std::string& file,
                        const Limits& limits = {});

/// The same of USD as text (its first line begins with "\#usda 1."): defaults and time samples.
/// What parse_usda refuses is refused, with the line, and so are statements that are none.
UsdStage read_usda_stage(std::string_view text, const std::string& file, const Limits& limits = {});

}  // namespace atelier
