#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.h"
#include "core/tensor.h"

namespace atelier {

/// The part of the YAML of OpenCV's FileStorage that calibrations use: numbers and texts, lists of
/// texts, and matrices of dt d, f, i or u at the outermost level; other values are passed over.
struct OpencvYaml {
  std::map<std::string, std::string> scalars;             ///< numbers too, as they stand there
  std::map<std::string, std::vector<std::string>> lists;  ///< of texts or numbers
  std::map<std::string, RowMatrix> matrices;
};

/// Throws DataError, with the line, for a file without "%YAML" in its first line, a key twice, a
/// matrix whose numbers are not as many as rows times cols (paid for by the bytes that remain), and
/// numbers that are not finite. OpenCV's own reader is not used: it is not made for hostile files.
OpencvYaml parse_opencv_yaml(std::string_view text, const std::string& file = "",
                             const Limits& limits = {});

/// A matrix as FileStorage writes it, shortest numbers.
std::string opencv_yaml_matrix(const std::string& name, const RowMatrix& matrix);

}  // namespace atelier
