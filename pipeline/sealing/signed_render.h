#pragma once

#include <filesystem>
#include <string>

#include "core/image.h"
#include "core/mark/image_mark.h"
#include "core/seal/minisign.h"
#include "pipeline/sealing/render_statement.h"

namespace atelier {

/// Images and films that say what they are: an invisible mark in each image (core/mark), and
/// content credentials in each file, signed.
class SignedRender {
 public:
  SignedRender(RenderStatement statement, SigningKey key);

  const RenderStatement& statement() const { return statement_; }

  /// A frame with its mark, for a film: linear, of 3 channels.
  Image marked(const Image& frame) const;

  /// Writes the image, marked, as a PNG with content credentials: linear light, with or without
  /// alpha that is not premultiplied. Throws EnvironmentError.
  void write_png(const std::filesystem::path& path, const Image& image) const;

  /// Appends content credentials to an MP4 of marked frames; it is replaced as a whole. Throws
  /// EnvironmentError, and DataError for more than kMostFilmBytes.
  void sign_film(const std::filesystem::path& film) const;

 private:
  RenderStatement statement_;
  SigningKey key_;
  ImageMark mark_;
};

}  // namespace atelier
