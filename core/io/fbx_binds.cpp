#include "core/io/fbx_binds.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/text_scanner.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr std::string_view kBinaryHead("Kaydara FBX Binary  \0\x1a\0", 23);
constexpr std::uint32_t kWideOffsets = 7500;  // version from which records count in 64 bits
constexpr std::size_t kNumbers = 16;

using MatrixNumbers = std::array<double, kNumbers>;

/// A matrix, by columns as the file has it, of the cluster that is being read.
class BindList {
 public:
  void add(std::string_view name, const MatrixNumbers& numbers) {
    const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix4d>(numbers.data());
    if (name == "Transform") {
      transform_ = matrix;
    } else if (transform_ && matrix.allFinite() && transform_->allFinite()) {
      binds_.push_back({*transform_, matrix});
      transform_.reset();
    }
  }
  std::vector<FbxBind> taken() { return std::move(binds_); }

 private:
  std::optional<Eigen::Matrix4d> transform_;
  std::vector<FbxBind> binds_;
};

bool is_bind_name(std::string_view name) {
  return name == "Transform" || name == "TransformLink";
}

/// Sixteen numbers: an array that is not compressed, or one after the other.
std::optional<MatrixNumbers> record_numbers(ByteReader& in, std::uint64_t properties) {
  MatrixNumbers numbers = {};
  const char type = in.text(1, "a type")[0];
  if (properties == 1 && type == 'd') {
    const auto count = in.little<std::uint32_t>("a count");
    const auto encoding = in.little<std::uint32_t>("an encoding");
    in.skip(4, "a length");
    if (count != kNumbers || encoding != 0) {
      return std::nullopt;
    }
    for (double& number : numbers) {
      number = in.little<double>("a number");
    }
    return numbers;
  }
  if (properties != kNumbers || type != 'D') {
    return std::nullopt;
  }
  numbers[0] = in.little<double>("a number");
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (in.text(1, "a type")[0] != 'D') {
      return std::nullopt;
    }
    numbers[i] = in.little<double>("a number");
  }
  return numbers;
}

/// Records one after the other, to `on_record(in, name, properties)` each, which leaves the reader
/// anywhere: a record's children follow its properties, and an empty record ends them.
template <class OnRecord>
void read_records(std::span<const std::byte> bytes, const OnRecord& on_record) {
  ByteReader in(bytes, "");
  in.skip(kBinaryHead.size(), "the head");
  const bool wide = in.little<std::uint32_t>("the version") >= kWideOffsets;
  const auto word = [&] {
    return wide ? in.little<std::uint64_t>("an offset")
                : std::uint64_t{in.little<std::uint32_t>("an offset")};
  };
  const std::size_t head = wide ? 25 : 13;
  while (in.remaining() >= head) {
    const std::uint64_t end = word();
    const std::uint64_t properties = word();
    const std::uint64_t length = word();
    const std::string_view name = in.text(in.little<std::uint8_t>("a length"), "a name");
    if (end == 0 && properties == 0 && length == 0 && name.empty()) {
      continue;
    }
    const std::size_t begin = in.position();
    if (length > 0) {
      on_record(in, name, properties);
    }
    in.seek(begin + length, "the next record");
  }
}

/// "Transform: *16 {\n a: 1,0,...}" (7.x) or "Transform: 1,0,..." (6.1).
void read_text(std::string_view text, BindList& binds) {
  constexpr std::string_view kName = "Transform";
  for (std::size_t at = text.find(kName); at != std::string_view::npos;
       at = text.find(kName, at + 1)) {
    const std::size_t colon = text.find(':', at);
    if (colon == std::string_view::npos || !is_bind_name(text.substr(at, colon - at))) {
      continue;
    }
    const std::string_view name = text.substr(at, colon - at);
    std::size_t from = text.find_first_not_of(" \t\r\n", colon + 1);
    if (from != std::string_view::npos && text[from] == '*') {
      from = text.find("a:", from);
      from = from == std::string_view::npos ? from : from + 2;
    }
    MatrixNumbers numbers = {};
    bool all = from != std::string_view::npos;
    for (std::size_t i = 0; all && i < numbers.size(); ++i) {
      from = text.find_first_not_of(" \t\r\n,", from);
      const std::size_t end =
          from == std::string_view::npos ? from : text.find_first_of(" \t\r\n,}", from);
      all =
          end != std::string_view::npos && parse_number(text.substr(from, end - from), numbers[i]);
      from = end;
    }
    if (all) {
      binds.add(name, numbers);
    }
  }
}

}  // namespace

namespace {

constexpr std::string_view kOrderProperty = "RotationOrder";

/// Properties of the nodes, as they come.
class ModelList {
 public:
  void begin(std::string_view name) {
    constexpr std::string_view kPrefix = "Model::";
    name = name.starts_with(kPrefix) ? name.substr(kPrefix.size()) : name;
    models_.emplace_back().name = name.substr(0, name.find('\0'));
  }

  void add(std::string_view property, const Eigen::Vector3d& value) {
    if (models_.empty() || !value.allFinite()) {
      return;  // the template of all nodes
    }
    FbxModel& model = models_.back();
    if (property == "GeometricTranslation") {
      model.geometric_translation = value;
    } else if (property == "GeometricRotation") {
      model.geometric_rotation = value;
    } else if (property == "GeometricScaling") {
      model.geometric_scaling = value;
    } else if (property == "PostRotation") {
      model.post_rotation = value;
    } else {
      model.pivots = model.pivots || !value.isZero(0);
    }
  }

  void set_order(double order) {
    if (!models_.empty() && order >= 0 && order <= 5) {
      models_.back().rotation_order = saturating_cast<int>(order);
    }
  }

  std::vector<FbxModel> taken() {
    std::erase_if(models_, [](const FbxModel& model) {
      return !model.has_geometric() && model.post_rotation.isZero(0);
    });
    return std::move(models_);
  }

 private:
  std::vector<FbxModel> models_;
};

bool is_place_name(std::string_view name) {
  constexpr std::array<std::string_view, 8> kNames = {
      "GeometricTranslation", "GeometricRotation", "GeometricScaling", "PostRotation",
      "RotationPivot",        "RotationOffset",    "ScalingPivot",     "ScalingOffset"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

std::string_view record_text(ByteReader& in) {
  return in.text(1, "a type") == "S" ? in.text(in.little<std::uint32_t>("a length"), "a text")
                                     : std::string_view();
}

void add_record(ByteReader& in, std::string_view name, std::uint64_t properties,
                ModelList& models) {
  if (name == "Model" && properties >= 2) {
    ByteReader ahead = in;
    if (ahead.text(1, "a type") == "L") {  // a number first, from 7.0 on
      in.skip(9, "a number");
    }
    models.begin(record_text(in));
  } else if (name == "P" || name == "Property") {
    const std::string_view property = record_text(in);
    if (property == kOrderProperty && properties >= 4) {
      for (std::uint64_t text = 1; text + 1 < properties; ++text) {
        record_text(in);
      }
      if (in.text(1, "a type") == "I") {
        models.set_order(in.little<std::int32_t>("an order"));
      }
    }
    if (!is_place_name(property) || properties < 6) {
      return;
    }
    for (std::uint64_t text = 1; text + 3 < properties; ++text) {
      record_text(in);
    }
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    for (double& number : value) {
      if (in.text(1, "a type") != "D") {
        return;
      }
      number = in.little<double>("a number");
    }
    models.add(property, value);
  }
}

/// The text between the first quotes of a line.
std::string_view first_quoted(std::string_view line) {
  const std::size_t begin = line.find('"');
  const std::size_t end = begin == std::string_view::npos ? begin : line.find('"', begin + 1);
  return end == std::string_view::npos ? std::string_view()
                                       : line.substr(begin + 1, end - begin - 1);
}

void add_line(std::string_view line, ModelList& models) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
  if (line.starts_with("Model:")) {
    models.begin(first_quoted(line));
    return;
  }
  const std::string_view property = first_quoted(line);
  if ((!line.starts_with("P:") && !line.starts_with("Property:")) ||
      (property != kOrderProperty && !is_place_name(property))) {
    return;
  }
  std::string_view rest = line.substr(0, line.find_last_not_of(" \t\r") + 1);
  if (property == kOrderProperty) {
    double order = 0;
    if (parse_number(rest.substr(rest.rfind(',') + 1), order)) {
      models.set_order(order);
    }
    return;
  }
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  for (int axis = 2; axis >= 0; --axis) {
    const std::size_t comma = rest.rfind(',');
    if (comma == std::string_view::npos) {
      return;
    }
    std::string_view number = rest.substr(comma + 1);
    number.remove_prefix(std::min(number.find_first_not_of(" \t"), number.size()));
    if (!parse_number(number, value[axis])) {
      return;
    }
    rest = rest.substr(0, comma);
  }
  models.add(property, value);
}

}  // namespace

std::vector<FbxModel> fbx_models(std::span<const std::byte> bytes) {
  ModelList models;
  if (as_text(bytes).starts_with(kBinaryHead)) {
    try {
      read_records(bytes, [&](ByteReader& in, std::string_view name, std::uint64_t properties) {
        add_record(in, name, properties, models);
      });
    } catch (const DataError&) {
      // the footer, or what libassimp did not mind
    }
  } else {
    std::string_view text = as_text(bytes);
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      add_line(text.substr(0, end), models);
      text.remove_prefix(std::min(end + 1, text.size()));
    }
  }
  return models.taken();
}

std::vector<FbxBind> fbx_binds(std::span<const std::byte> bytes) {
  BindList binds;
  if (as_text(bytes).starts_with(kBinaryHead)) {
    try {
      read_records(bytes, [&](ByteReader& in, std::string_view name, std::uint64_t properties) {
        if (is_bind_name(name)) {
          if (const std::optional<MatrixNumbers> numbers = record_numbers(in, properties)) {
            binds.add(name, *numbers);
          }
        }
      });
    } catch (const DataError&) {
      // the footer, or what libassimp did not mind
    }
  } else {
    read_text(as_text(bytes), binds);
  }
  return binds.taken();
}

}  // namespace atelier
