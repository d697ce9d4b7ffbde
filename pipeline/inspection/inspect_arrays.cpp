#include <algorithm>
#include <limits>

#include "core/archive.h"
#include "core/archive_index.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/foreign_hdf5.h"
#include "core/io/npy.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "core/io/zip_archive.h"
#include "core/regular_file.h"
#include "pipeline/inspection/inspection.h"

namespace atelier {
namespace {

bool is_marked(const std::filesystem::path& path, std::string_view mark) {
  const auto size = static_cast<std::int64_t>(mark.size());
  const FileStart start = read_file_start(path, size, std::numeric_limits<std::int64_t>::max());
  return std::ssize(start.bytes) == size &&
         std::equal(mark.begin(), mark.end(), start.bytes.begin(),
                    [](char a, std::byte b) { return static_cast<std::byte>(a) == b; });
}

/// Limits on the numbers read of another program's HDF5: of one dataset at once, so that neither
/// the worker nor the conversion to doubles needs much memory; and of the file.
constexpr std::int64_t kElementsAtOnce = 32LL << 20;
constexpr std::int64_t kElementsOfFile = 256LL << 20;

/// Text is counted by what a string costs beside its letters.
std::int64_t cost_of(const Tensor& tensor) {
  constexpr std::int64_t kString = 16;
  const auto elements = element_count(tensor.shape, kElementsOfFile);
  return elements ? *elements * (tensor.type == ElementType::Text ? kString : 1)
                  : kElementsOfFile + 1;
}

/// Reads the datasets, each with its checksums, and judges their numbers. Throws DataError for the
/// first that is damaged.
void judge_datasets(const std::filesystem::path& path, const ForeignHdf5Contents& contents,
                    Inspection& inspection) {
  std::vector<std::string> names;  // a process reads them together
  std::int64_t at_once = 0;
  const auto read = [&] {
    for (const auto& [name, tensor] : read_foreign_hdf5(path, names)) {
      add_array(name, tensor, inspection);
    }
    names.clear();
    at_once = 0;
  };
  std::int64_t left = kElementsOfFile;
  std::vector<std::string> not_read;
  for (const auto& [name, tensor] : contents.datasets) {
    const std::int64_t cost = cost_of(tensor);
    if (cost > kElementsAtOnce || cost > left) {
      not_read.push_back(name);
      inspection.add_member(name,
                            {{"type", element_type_name(tensor.type)}, {"shape", tensor.shape}});
      continue;
    }
    if (at_once + cost > kElementsAtOnce) {
      read();
    }
    names.push_back(name);
    at_once += cost;
    left -= cost;
  }
  if (!names.empty()) {
    read();
  }
  if (!not_read.empty()) {
    inspection.findings.push_back({Severity::Note, "hdf5-not-looked-at", not_read.front(),
                                   std::to_string(not_read.size()) + " of its " +
                                       std::to_string(contents.datasets.size()) +
                                       " datasets are too large to be looked at: this is the first",
                                   "of these, nothing but type and shape is known"});
  }
}

void inspect_foreign_hdf5(const std::filesystem::path& path, Inspection& inspection) {
  const ForeignHdf5Contents contents = foreign_hdf5_contents(path);
  inspection.add("kind", "HDF5 of another program");
  inspection.add("datasets", contents.datasets.size());
  inspection.add("attributes", contents.attributes.size());
  inspection.add("left out", contents.left_out.size());
  judge_datasets(path, contents, inspection);
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
  inspect_person(path, inspection);
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
  if (const std::vector<std::string> links = zip.symbolic_links(); !links.empty()) {
    inspection.findings.push_back(
        {Severity::Error, "zip-link", links.front().substr(0, 80),
         std::to_string(links.size()) +
             " of its files would be symbolic links, behind which others may be written anywhere",
         "do not unpack it with a program that makes links"});
  }
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
  if (is_marked(path, "\x89HDF")) {
    inspect_foreign_hdf5(path, inspection);
    return;
  }
  if (!is_marked(path, kArchiveMagic)) {
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
