#include "core/io/usd_sequence.h"

#include <algorithm>
#include <limits>
#include <set>

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

void append_points(std::string& text, const Points& points) {
  text += '[';
  for (Index v = 0; v < points.rows(); ++v) {
    text += v > 0 ? ", " : "";
    append_point(text, points.row(v));
  }
  text += ']';
}

/// Smallest and largest corner.
Points extent_of(const Points& points) {
  Points extent(2, 3);
  extent << points.colwise().minCoeff(), points.colwise().maxCoeff();
  return extent;
}

/// The prim of one sequence, written as its frames are read. The first frame is its default, too:
/// programs that play nothing show that.
void write_prim(AtomicFile& file, const Sequence& sequence, const std::string& name) {
  std::string text = "\n    def Mesh \"" + name + "\"\n    {\n";
  text += "        uniform token subdivisionScheme = \"none\"\n";
  text += "        uniform bool doubleSided = 1\n";
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
  const Points first = frame(sequence, 0).vertices;
  text += "]\n        float3[] extent = ";
  append_points(text, extent_of(first));
  text += "\n        point3f[] points = ";
  append_points(text, first);
  text += "\n        point3f[] points.timeSamples = {\n";
  std::string extents = "        float3[] extent.timeSamples = {\n";
  for (Index i = 0; i < frame_count(sequence); ++i) {
    const Points points = frame(sequence, i).vertices;
    const std::string time = number_text(sequence.frame_ids[static_cast<std::size_t>(i)]) + ": ";
    text += time;
    append_points(text, points);
    text += ",\n";
    file.write(text);
    text.clear();
    extents += time;
    append_points(extents, extent_of(points));
    extents += ",\n";
  }
  file.write("        }\n" + extents + "        }\n    }\n");
}

}  // namespace

void write_usd_sequences(const std::filesystem::path& path,
                         std::span<const NamedSequence> sequences) {
  ATELIER_CHECK(!sequences.empty(), "USD takes at least one sequence");
  const double fps = sequences.front().sequence.fps;
  ATELIER_CHECK(fps > 0, "USD takes a frame rate");
  int first = std::numeric_limits<int>::max();
  int last = std::numeric_limits<int>::min();
  std::set<std::string> names;
  for (const auto& [name, sequence] : sequences) {
    ATELIER_CHECK(frame_count(sequence) > 0 && sequence.faces.rows() > 0,
                  "USD takes frames over one topology");
    ATELIER_CHECK(sequence.fps == fps, "sequences of one USD file have one frame rate");
    ATELIER_CHECK(names.insert(prim_name(name)).second, "two prims of the name " + prim_name(name));
    first = std::min(first, sequence.frame_ids.front());
    last = std::max(last, sequence.frame_ids.back());
  }
  AtomicFile file(path);
  std::string text = "#usda 1.0\n(\n    defaultPrim = \"root\"\n    metersPerUnit = 1\n";
  text += "    upAxis = \"Y\"\n    timeCodesPerSecond = " + number_text(fps);
  text += "\n    framesPerSecond = " + number_text(fps);
  text += "\n    startTimeCode = " + number_text(first);
  text += "\n    endTimeCode = " + number_text(last);
  file.write(text + "\n)\n\ndef Xform \"root\"\n{");
  for (const auto& [name, sequence] : sequences) {
    write_prim(file, sequence, prim_name(name));
  }
  file.write("}\n");
  file.commit();
}

void write_usd_sequence(const std::filesystem::path& path, const Sequence& sequence,
                        const std::string& name) {
  const NamedSequence one{name, sequence};
  write_usd_sequences(path, std::span(&one, 1));
}

}  // namespace atelier
