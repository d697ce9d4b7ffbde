#include <algorithm>
#include <fstream>

#include "apps/inspection.h"
#include "core/archive.h"
#include "core/archive_index.h"
#include "core/error.h"
#include "core/io/foreign_hdf5.h"
#include "core/io/npy.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "core/io/zip_archive.h"
#include "core/regular_file.h"

namespace atelier {
namespace {

bool begins_with(const std::filesystem::path& path, std::string_view mark) {
  std::string begin(mark.size(), '\0');
  std::ifstream(path, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin == mark;
}

void inspect_foreign_hdf5(const std::filesystem::path& path, Inspection& inspection) {
  const ForeignHdf5Contents contents = foreign_hdf5_contents(path);
  inspection.add("kind", "HDF5 of another program");
  inspection.add("datasets", contents.datasets.size());
  inspection.add("attributes", contents.attributes.size());
  inspection.add("left out", contents.left_out.size());
  for (const auto& [name, tensor] : contents.datasets) {
    inspection.add_member(name,
                          {{"type", element_type_name(tensor.type)}, {"shape", tensor.shape}});
  }
  for (const std::string& name : contents.attributes) {
    inspection.add_member(name, "attribute");
  }
  for (const auto& [name, why] : contents.left_out) {
    inspection.findings.push_back(
        {Severity::Warning, "hdf5-left-out", name, why, "it is not read; the rest of the file is"});
  }
}

/// A name that leads out of the folder that the zip is unpacked into.
bool leads_out(std::string_view name) {
  const bool drive = name.size() > 1 && name[1] == ':';
  if (name.empty() || name[0] == '/' || name[0] == '\\' || drive) {
    return true;
  }
  while (!name.empty()) {
    const std::size_t end = std::min(name.find_first_of("/\\"), name.size());
    if (name.substr(0, end) == "..") {
      return true;
    }
    name.remove_prefix(std::min(end + 1, name.size()));
  }
  return false;
}

void add_unsafe_names(const std::vector<std::string>& names, Inspection& inspection) {
  const auto first = std::find_if(names.begin(), names.end(), leads_out);
  if (first != names.end()) {
    inspection.findings.push_back(
        {Severity::Error, "zip-name", first->substr(0, 80),
         std::to_string(std::count_if(first, names.end(), leads_out)) +
             " of its files would be written outside of the folder that it is unpacked into",
         "do not unpack it with a program that follows such names"});
  }
}

}  // namespace

void inspect_npy(const std::filesystem::path& path, Inspection& inspection) {
  inspection.add("kind", "npy");
  add_array("array", read_npy(path), inspection);
}

void inspect_npz(const std::filesystem::path& path, Inspection& inspection) {
  const Npz npz(path);
  inspection.add("kind", "npz");
  inspection.add("arrays", npz.names().size());
  for (const std::string& name : npz.names()) {
    add_array(name, npz.read(name), inspection);
  }
#ifdef ATELIER_HAS_BODYMODEL
  inspect_person(path, inspection);
#endif
}

void inspect_zip(const std::filesystem::path& path, Inspection& inspection) {
  const ZipArchive zip(path);
  zip.check();
  inspection.add("kind", "zip");
  inspection.add("files", std::count_if(zip.names().begin(), zip.names().end(),
                                        [](const auto& name) { return !name.ends_with('/'); }));
  if (!zip.names().empty()) {
    inspection.add("first", zip.names().front());
    inspection.add("last", zip.names().back());
  }
  add_unsafe_names(zip.names(), inspection);
}

void inspect_safetensors(const std::filesystem::path& path, Inspection& inspection) {
  const Safetensors content = read_safetensors(path);
  inspection.add("kind", "safetensors");
  inspection.add("tensors", content.tensors.size());
  nlohmann::ordered_json metadata = nlohmann::ordered_json::object();
  for (const auto& [name, text] : content.metadata) {
    metadata[name] = text.substr(0, 80);
  }
  inspection.add("metadata", metadata);
  for (const auto& [name, tensor] : content.tensors) {
    add_array(name, tensor, inspection);
  }
  judge_network(content, path);
}

void inspect_hdf5(const std::filesystem::path& path, Inspection& inspection) {
  // Atelier's own archives begin with their index; what begins with HDF5's mark is of others.
  const RegularFile readable(path);
  if (begins_with(path, "\x89HDF")) {
    inspect_foreign_hdf5(path, inspection);
    return;
  }
  if (!begins_with(path, kArchiveMagic)) {
    throw DataError(path.string(), "byte 0", "no HDF5 file", "HDF5, Atelier's own or of others");
  }
  const Archive archive = read_any_archive(path);
  inspection.add("kind", "archive of schema '" + archive.schema + "', version " +
                             std::to_string(archive.version));
  inspection.add("unit", archive.units);
  inspection.add("up", archive.up_axis);
  for (const auto& [name, value] : archive.numbers) {
    inspection.add_member(name, value);
  }
  for (const auto& [name, text] : archive.texts) {
    inspection.add_member(name, text.substr(0, 80));
  }
  for (const auto& [name, tensor] : archive.datasets) {
    add_array(name, tensor, inspection);
  }
  judge_archive(archive, path, inspection);
}

}  // namespace atelier
