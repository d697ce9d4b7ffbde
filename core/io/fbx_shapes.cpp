#include "core/io/fbx_shapes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <string_view>

#include "core/io/fbx_records.h"

namespace atelier {
namespace {

/// A blend-shape channel, as it comes.
struct Channel {
  std::string name;
  std::optional<double> field;     ///< per cent: DeformPercent as a record
  std::optional<double> property;  ///< the same as a property, which goes before
  std::vector<double> full;        ///< per cent at which each shape is whole
  std::vector<std::int64_t> shapes;
};

/// Objects of interest by their identities, and what they are connected to.
struct Deformers {
  std::map<std::int64_t, Channel> channels;
  std::map<std::int64_t, std::string> geometries;
  Channel* open = nullptr;  ///< whose children come
  bool mixes = false;       ///< the skin whose children come is linear but for its BlendWeights
  bool unread = false;      ///< such weights, that are compressed
  bool dual_quaternions = false;
};

void begin_object(const FbxRecord& record, Deformers& all) {
  const std::vector<FbxValue>& values = record.values;
  all.open = nullptr;
  all.mixes = false;
  if (values.size() < 3 || !values[1].is_text || !values[2].is_text) {
    return;
  }
  const std::string name(fbx_object_name(values[1].text));
  if (record.name == "Geometry") {
    all.geometries[values[0].integer] = name;
  } else if (record.name == "Deformer" && values[2].text == "BlendShapeChannel") {
    all.open = &all.channels[values[0].integer];
    all.open->name = name;
  }
}

// 3ds Max writes "Blend" with weights of 0: a linear skin.
void add_to_skin(const FbxRecord& record, Deformers& all) {
  const std::vector<FbxValue>& values = record.values;
  if (record.name == "SkinningType" && !values.empty()) {
    all.mixes = values[0].text == "Blend";
    all.dual_quaternions = all.dual_quaternions || values[0].text == "DualQuaternion";
  } else if (record.name == "BlendWeights" && all.mixes) {
    all.unread = all.unread || values.empty();
    all.dual_quaternions =
        all.dual_quaternions || std::any_of(values.begin(), values.end(),
                                            [](const FbxValue& one) { return one.number != 0; });
  }
}

void add_to_channel(const FbxRecord& record, Channel& channel) {
  const std::vector<FbxValue>& values = record.values;
  if (record.name == "DeformPercent" && !values.empty()) {
    channel.field = values[0].number;
  } else if (record.name == "P" && values.size() > 4 && values[0].text == "DeformPercent") {
    channel.property = values.back().number;
  } else if (record.name == "FullWeights") {
    for (const FbxValue& value : values) {
      channel.full.push_back(value.number);
    }
  }
}

}  // namespace

std::vector<double> fbx_shape_parts(double value, const std::vector<double>& whole) {
  std::vector<double> parts(whole.size(), 0);
  // Outwards from 0 on the side on which the value is; where there are none, on the other.
  const auto outwards = [&](double side) {
    std::vector<std::size_t> order(whole.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::erase_if(order, [&](std::size_t i) { return !(side * whole[i] > 0); });
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return side * whole[a] < side * whole[b]; });
    return order;
  };
  const double side = value < 0 ? -1 : 1;
  std::vector<std::size_t> order = outwards(side);
  if (order.empty()) {
    order = outwards(-side);
    order.resize(std::min<std::size_t>(order.size(), 1));
  }
  for (std::size_t k = 0; k < order.size(); ++k) {
    const double to = whole[order[k]];
    if (side * to < side * value && k + 1 < order.size()) {
      continue;
    }
    const double from = k > 0 ? whole[order[k - 1]] : 0;
    parts[order[k]] = (value - from) / (to - from);
    if (k > 0) {
      parts[order[k - 1]] = 1 - parts[order[k]];
    }
    break;
  }
  return parts;
}

FbxShapes::FbxShapes(std::span<const std::byte> bytes) {
  constexpr std::array<std::string_view, 9> kNames = {
      "BlendWeights",  "Geometry",    "Deformer",     "Model", "P",
      "DeformPercent", "FullWeights", "SkinningType", "C"};
  Deformers all;
  read_fbx_records(bytes, kNames, [&](const FbxRecord& record) {
    const std::vector<FbxValue>& values = record.values;
    if (record.name == "C") {
      if (values.size() < 3) {
        return;
      }
      const auto channel = all.channels.find(values[2].integer);
      if (channel != all.channels.end() && all.geometries.contains(values[1].integer)) {
        channel->second.shapes.push_back(values[1].integer);
      }
    } else if (record.name == "SkinningType" || record.name == "BlendWeights") {
      add_to_skin(record, all);
    } else if (record.name == "Geometry" || record.name == "Deformer" || record.name == "Model") {
      begin_object(record, all);
    } else if (all.open != nullptr) {
      add_to_channel(record, *all.open);
    }
  });
  dual_quaternions_ = all.dual_quaternions;
  unread_weights_ = all.unread;
  for (const auto& [identity, channel] : all.channels) {
    const double percent = channel.property.value_or(channel.field.value_or(0));
    const std::size_t count = channel.shapes.size();
    std::vector<double> weights(count, percent / 100);
    if (channel.full.size() == count) {
      weights = fbx_shape_parts(percent, channel.full);
    } else if (count > 1 && percent != 0) {
      weights.assign(count, std::numeric_limits<double>::quiet_NaN());
    }
    add(channel.name, weights);
    for (std::size_t s = 0; s < weights.size(); ++s) {
      const std::string& shape = all.geometries[channel.shapes[s]];
      if (shape != channel.name) {
        add(shape, {weights[s]});
      }
    }
  }
}

void FbxShapes::add(const std::string& name, const std::vector<double>& weights) {
  const auto [known, fresh] = weights_.try_emplace(name, weights);
  if (!fresh && known->second != weights) {
    known->second.assign(1, std::numeric_limits<double>::quiet_NaN());
  }
}

double FbxShapes::weight(const std::string& name, std::size_t turn) const {
  // What has no name is called by its class alone.
  const auto found = weights_.find(name.ends_with("::") ? "" : name);
  if (found == weights_.end() || found->second.empty()) {
    return 0;
  }
  return found->second[std::min(turn, found->second.size() - 1)];
}

}  // namespace atelier
