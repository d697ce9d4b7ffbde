#include "core/io/usd_sequence.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/text_writer.h"

namespace atelier {
namespace {

std::string prim_name(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    const bool digit = c >= '0' && c <= '9';
    out += letter || (digit && !out.empty()) ? c : '_';
  }
  return out.empty() ? "mesh" : out;
}

void append_point(std::string& text, const Eigen::RowVector3d& p) {
  text += '(';
  for (int k = 0; k < 3; ++k) {
    append_number(text, static_cast<float>(p[k]));
    text += k < 2 ? ", " : ")";
  }
}

}  // namespace

void write_usd_sequence(const std::filesystem::path& path, const Sequence& sequence,
                        const std::string& name) {
  const Index count = frame_count(sequence);
  ATELIER_CHECK(count > 0 && sequence.faces.rows() > 0, "USD takes frames over one topology");
  ATELIER_CHECK(sequence.fps > 0, "USD takes a frame rate");
  AtomicFile file(path);
  std::string text = "#usda 1.0\n(\n    defaultPrim = \"root\"\n    metersPerUnit = 1\n";
  text += "    upAxis = \"Y\"\n    timeCodesPerSecond = " + number_text(sequence.fps);
  text += "\n    framesPerSecond = " + number_text(sequence.fps);
  text += "\n    startTimeCode = " + number_text(sequence.frame_ids.front());
  text += "\n    endTimeCode = " + number_text(sequence.frame_ids.back());
  text += "\n)\n\ndef Xform \"root\"\n{\n    def Mesh \"" + prim_name(name) + "\"\n    {\n";
  text += "        uniform token subdivisionScheme = \"none\"\n";
  text += "        int[] faceVertexCounts = [";
  for (Index f = 0; f < sequence.faces.rows(); ++f) {
    text += f > 0 ? ", 3" : "3";
  }
  text += "]\n        int[] faceVertexIndices = [";
  for (Index f = 0; f < sequence.faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      text += f + c > 0 ? ", " : "";
      append_number(text, sequence.faces(f, c));
    }
  }
  text += "]\n        point3f[] points.timeSamples = {\n";
  for (Index i = 0; i < count; ++i) {
    const Points points = frame(sequence, i).vertices;
    append_number(text, sequence.frame_ids[static_cast<std::size_t>(i)]);
    text += ": [";
    for (Index v = 0; v < points.rows(); ++v) {
      text += v > 0 ? ", " : "";
      append_point(text, points.row(v));
    }
    text += "],\n";
    file.write(text);
    text.clear();
  }
  text += "        }\n    }\n}\n";
  file.write(text);
  file.commit();
}

}  // namespace atelier
