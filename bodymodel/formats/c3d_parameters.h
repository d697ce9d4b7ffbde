#pragma once

// Numbers, header and parameters of a C3D file, behind motion_c3d.h.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/io/byte_reader.h"

namespace atelier {

/// How a C3D file stores numbers, as its processor type says.
enum class C3dProcessor { Intel = 84, Dec = 85, Mips = 86 };

/// Numbers of a C3D file: little-endian (Intel), big-endian (MIPS, which SGI used), or DEC's:
/// little-endian integers and the VAX's F_floating (VAX Architecture Reference Manual, 1987, 1.3).
class C3dNumbers {
 public:
  C3dNumbers(std::span<const std::byte> bytes, const std::string& file, C3dProcessor processor)
      : reader_(bytes, file), processor_(processor) {}

  template <class T>
  T next(std::string_view what) {
    return processor_ == C3dProcessor::Mips ? reader_.big<T>(what) : reader_.little<T>(what);
  }
  double real(std::string_view what);
  ByteReader& reader() { return reader_; }

 private:
  ByteReader reader_;
  C3dProcessor processor_;
};

/// One parameter as it stands in the file.
struct C3dParameter {
  int type = 0;  ///< -1 text, 1 byte, 2 integer, 4 real
  std::vector<std::size_t> sizes;
  std::span<const std::byte> data;
};

/// Contents of the first block of a file.
struct C3dHeader {
  int points = 0;
  int analog = 0;          ///< numbers a frame
  int analog_samples = 0;  ///< of each channel a frame
  int first = 0;
  int last = 0;
  double scale = 0;  ///< below 0: coordinates are real numbers
  double fps = 0;
  std::uint64_t data = 0;  ///< byte
};

/// Header and parameters.
class C3dFile {
 public:
  /// Throws DataError as read_c3d says. The span must outlive the object.
  C3dFile(std::span<const std::byte> bytes, const std::string& file);

  C3dProcessor processor() const { return processor_; }
  const C3dHeader& header() const { return header_; }
  const std::vector<Finding>& findings() const { return findings_; }

  /// Type of a parameter ("POINT:FRAMES"), 0 where there is none.
  int type(const std::string& name) const;

  /// Numbers of a parameter, whole ones without a sign; none where it is text or missing.
  std::vector<double> numbers(const std::string& name) const;
  std::optional<double> number(const std::string& name) const;

  /// Texts of a parameter without blanks around them; those of NAME2, NAME3, ... follow, since one
  /// parameter holds 255.
  std::vector<std::string> texts(const std::string& name) const;

 private:
  void read_header();
  void read_parameters(std::uint64_t offset);

  std::span<const std::byte> bytes_;
  std::string file_;
  C3dProcessor processor_ = C3dProcessor::Intel;
  C3dHeader header_;
  std::map<std::string, C3dParameter> parameters_;
  std::vector<Finding> findings_;
};

}  // namespace atelier
