#include "core/archive_arrays.h"

#include "core/sequence_archive.h"

namespace atelier {

Tensor tensor_of_texts(const std::vector<std::string>& values) {
  Tensor tensor;
  tensor.type = ElementType::Text;
  tensor.shape = {static_cast<std::int64_t>(values.size())};
  tensor.strings = values;
  return tensor;
}

void put_array(Archive& archive, const std::string& name, Tensor tensor) {
  if (element_count(tensor) > 0) {
    archive.datasets[name] = std::move(tensor);
  }
}

void put_mesh(Archive& archive, const std::string& group, const Mesh& mesh) {
  const std::string prefix = group + "/";
  for (auto& [name, tensor] : archive_of(mesh).datasets) {
    archive.datasets[prefix + name] = tensor;
  }
}

Mesh mesh_at(const Archive& archive, const std::string& group, const std::string& file) {
  Archive part;
  part.schema = "atelier.mesh";
  for (const auto& [name, tensor] : archive.datasets) {
    if (name.starts_with(group + "/") && name.find('/', group.size() + 1) == std::string::npos) {
      part.datasets[name.substr(group.size() + 1)] = tensor;
    }
  }
  return mesh_of(part, file);
}

void check_units(const Archive& archive, const std::string& file) {
  if (archive.units != "m" || archive.up_axis != "y") {
    throw DataError(file, "units", archive.units + ", up " + archive.up_axis, "m, up y");
  }
}

void check_names(const Archive& archive, const std::string& file,
                 const std::function<bool(const std::string&)>& is_named) {
  for (const auto& [name, tensor] : archive.datasets) {
    if (!is_named(name)) {
      throw DataError(file, name, "not of this schema",
                      "only what docs/reference/formats.md names");
    }
  }
}

const Tensor* find_array(const Archive& archive, const std::string& name) {
  const auto found = archive.datasets.find(name);
  return found == archive.datasets.end() ? nullptr : &found->second;
}

const Tensor& array_at(const Archive& archive, const std::string& name, const std::string& file) {
  const Tensor* tensor = find_array(archive, name);
  if (tensor == nullptr) {
    throw DataError(file, name, "no such dataset", "one of schema " + archive.schema);
  }
  return *tensor;
}

std::vector<std::string> texts_at(const Archive& archive, const std::string& name,
                                  const std::string& file) {
  const Tensor* tensor = find_array(archive, name);
  if (tensor == nullptr) {
    return {};
  }
  if (tensor->type != ElementType::Text || tensor->shape.size() != 1) {
    throw DataError(file, name, element_type_name(tensor->type), "a list of texts");
  }
  return tensor->strings;
}

std::vector<int> indices_of(const Tensor& tensor, Index count, const std::string& file,
                            const std::string& name) {
  std::vector<int> indices;
  for (const std::int64_t index : integers_of(tensor, file, name)) {
    if (index < 0 || index >= count) {
      throw DataError(file, name, "index " + std::to_string(index),
                      "indices in [0, " + std::to_string(count) + ")");
    }
    indices.push_back(static_cast<int>(index));
  }
  return indices;
}

std::span<const float> floats_at(const Archive& archive, const std::string& name,
                                 const std::vector<std::int64_t>& shape, const std::string& file) {
  const Tensor& tensor = array_at(archive, name, file);
  if (tensor.type != ElementType::Float32 || tensor.shape != shape) {
    throw DataError(file, name,
                    std::string(element_type_name(tensor.type)) + " " + shape_text(tensor.shape),
                    "float32 " + shape_text(shape));
  }
  check_finite(tensor, file, name);
  return values_of<float>(tensor);
}

}  // namespace atelier
