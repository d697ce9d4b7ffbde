#include "core/io/foreign_hdf5.h"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <functional>
#include <system_error>

#include <sys/mman.h>
#include <unistd.h>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/hdf5_walk.h"
#include "core/io/worker.h"
#include "core/regular_file.h"

namespace atelier {
namespace {

// --- what the worker says -----------------------------------------------------------------------

/// Puts values behind each other; ReplyReader takes them apart again and trusts none of them.
class ReplyWriter {
 public:
  template <class T>
  void number(T value) {
    const auto raw = std::as_bytes(std::span(&value, 1));
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
  }
  void block(std::span<const std::byte> bytes) {
    number<std::uint64_t>(bytes.size());
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void text(const std::string& text) { block(std::as_bytes(std::span(text))); }
  void tensor(const Tensor& tensor) {
    number(static_cast<std::uint8_t>(tensor.type));
    number(static_cast<std::uint8_t>(tensor.shape.size()));
    for (const std::int64_t size : tensor.shape) {
      number(size);
    }
    block(tensor.data);
    number<std::uint64_t>(tensor.strings.size());
    for (const std::string& value : tensor.strings) {
      text(value);
    }
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

class ReplyReader {
 public:
  ReplyReader(std::span<const std::byte> bytes, const std::string& file, const Limits& limits)
      : reader_(bytes, file), limits_(limits) {}

  std::size_t count() { return reader_.paid(reader_.little<std::uint64_t>("count"), 1, "entries"); }
  std::string text() { return std::string(reader_.text(count(), "text")); }

  /// @param with_data  whether the elements came too, or only type and shape
  Tensor tensor(bool with_data) {
    const auto type = reader_.little<std::uint8_t>("type");
    const auto rank = reader_.little<std::uint8_t>("rank");
    if (type > static_cast<std::uint8_t>(ElementType::Text) || rank > limits_.tensor_rank) {
      fail();
    }
    Tensor tensor{static_cast<ElementType>(type), {}, {}, {}};
    for (int d = 0; d < rank; ++d) {
      tensor.shape.push_back(reader_.little<std::int64_t>("size"));
    }
    const auto data = reader_.take(count(), "data");
    tensor.data.assign(data.begin(), data.end());
    const std::size_t strings = count();
    for (std::size_t i = 0; i < strings; ++i) {
      tensor.strings.push_back(text());
    }
    const auto elements = element_count(tensor.shape, limits_.tensor_bytes);
    if (!elements) {
      fail();
    }
    const bool is_text = tensor.type == ElementType::Text;
    const auto expected = with_data ? static_cast<std::size_t>(*elements) : 0;
    if (tensor.data.size() != (is_text ? 0 : expected * element_bytes(tensor.type)) ||
        tensor.strings.size() != (is_text ? expected : 0)) {
      fail();
    }
    return tensor;
  }

  void check_end() {
    if (reader_.remaining() > 0) {
      fail();
    }
  }

 private:
  [[noreturn]] void fail() {
    reader_.fail("the process that read the file answered nonsense", "a sound file");
  }

  ByteReader reader_;
  const Limits& limits_;
};

/// A file in memory without reading it: pages come when the worker touches them. If the file
/// becomes shorter meanwhile, only the worker dies of it.
class Mapping {
 public:
  explicit Mapping(const std::filesystem::path& path) {
    const RegularFile file(path);
    size_ = static_cast<std::size_t>(file.size());
    if (size_ == 0) {
      throw DataError(path.string(), "", "an empty file", "HDF5");
    }
    data_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file.descriptor(), 0);
    if (data_ == MAP_FAILED) {
      throw EnvironmentError(path.string(), "cannot be mapped into memory");
    }
  }
  ~Mapping() { munmap(data_, size_); }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  std::span<const std::byte> bytes() const { return {static_cast<const std::byte*>(data_), size_}; }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace

ForeignHdf5Contents parse_foreign_hdf5_contents(std::span<const std::byte> bytes,
                                                const std::string& file, const Limits& limits) {
  const std::vector<std::byte> reply = run_in_worker(
      [&] {
        const ForeignHdf5Contents contents = walk_hdf5(bytes, limits);
        ReplyWriter writer;
        writer.number<std::uint64_t>(contents.datasets.size());
        for (const auto& [name, tensor] : contents.datasets) {
          writer.text(name);
          writer.tensor(tensor);
        }
        writer.number<std::uint64_t>(contents.attributes.size());
        for (const std::string& name : contents.attributes) {
          writer.text(name);
        }
        writer.number<std::uint64_t>(contents.left_out.size());
        for (const auto& [name, why] : contents.left_out) {
          writer.text(name);
          writer.text(why);
        }
        return writer.take();
      },
      file, limits);
  ReplyReader reader(reply, file, limits);
  ForeignHdf5Contents contents;
  for (std::size_t i = reader.count(); i > 0; --i) {
    std::string name = reader.text();
    contents.datasets.emplace(std::move(name), reader.tensor(false));
  }
  for (std::size_t i = reader.count(); i > 0; --i) {
    contents.attributes.push_back(reader.text());
  }
  for (std::size_t i = reader.count(); i > 0; --i) {
    std::string name = reader.text();
    contents.left_out.emplace(std::move(name), reader.text());
  }
  reader.check_end();
  return contents;
}

std::map<std::string, Tensor> parse_foreign_hdf5(std::span<const std::byte> bytes,
                                                 const std::vector<std::string>& names,
                                                 const std::string& file, const Limits& limits) {
  const std::vector<std::byte> reply = run_in_worker(
      [&] {
        ReplyWriter writer;
        for (const Tensor& tensor : read_hdf5(bytes, names, limits)) {
          writer.tensor(tensor);
        }
        return writer.take();
      },
      file, limits);
  ReplyReader reader(reply, file, limits);
  std::map<std::string, Tensor> tensors;
  for (const std::string& name : names) {
    tensors.emplace(name, reader.tensor(true));
  }
  reader.check_end();
  return tensors;
}

ForeignHdf5Contents foreign_hdf5_contents(const std::filesystem::path& path, const Limits& limits) {
  const Mapping mapping(path);
  return parse_foreign_hdf5_contents(mapping.bytes(), path.string(), limits);
}

std::map<std::string, Tensor> read_foreign_hdf5(const std::filesystem::path& path,
                                                const std::vector<std::string>& names,
                                                const Limits& limits) {
  const Mapping mapping(path);
  return parse_foreign_hdf5(mapping.bytes(), names, path.string(), limits);
}

}  // namespace atelier
