#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "core/image.h"
#include "core/mark/image_mark.h"
#include "core/seal/minisign.h"
#include "pipeline/sealing/render_statement.h"

namespace atelier {

/// Images and videos that say what they are: an invisible mark in each image (core/mark), and
/// content credentials in each file, signed.
class SignedRender {
 public:
  SignedRender(RenderStatement statement, SigningKey key);

  const RenderStatement& statement() const { return statement_; }

  /// An image with its mark, for a PNG or a video: of linear light, with or without alpha that is
  /// not premultiplied.
  ByteImage marked(const Image& image) const;

  /// A marked image as a PNG with content credentials.
  std::string png(const ByteImage& marked) const;

  /// The same as a JPEG; without alpha.
  std::string jpeg(const ByteImage& marked) const;

  /// Marks an image and writes it: a JPEG where the name says so (.jpg), else a PNG. Throws
  /// EnvironmentError.
  void write(const std::filesystem::path& path, const Image& image) const;

  /// The box of content credentials that an MP4 of marked frames is to end with, for
  /// VideoWriter::finish. Throws DataError for more than kMaxVideoBytes.
  std::string video_credentials(const std::filesystem::path& video) const;

 private:
  RenderStatement statement_;
  SigningKey key_;
  ImageMark mark_;
};

/// A statement with who signs it: the secret key in a file or, where none is named, one that
/// follows from the statement, which everybody can derive, so that the same images have the same
/// bytes. Forbids core dumps before it reads a secret.
/// @param passphrase  of a key that has one
SignedRender signed_render(RenderStatement statement, const std::string& key_file,
                           const std::function<Secret()>& passphrase);

}  // namespace atelier
