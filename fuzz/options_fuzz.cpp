#include <string>
#include <string_view>
#include <vector>

#include "core/device.h"
#include "core/options.h"
#include "core/store/frame_selection.h"
#include "core/store/options_file.h"
#include "fuzz/reader.h"

namespace {

/// One field of every kind.
struct Fields {
  bool on = false;
  int count = 1;
  std::int64_t seed = 0;
  double gain = 1;
  std::string word = "a";
  std::string fabric = "wool";
  std::vector<double> list = {1, 2};
  atelier::Device device = atelier::Device::Cpu;
};

atelier::OptionTable table_of(Fields& fields) {
  atelier::OptionTable table;
  table.add("on", fields.on, "A switch");
  table.add("part.count", fields.count, 0, 10, "", "An integer");
  table.add("part.seed", fields.seed, -1e15, 1e15, "", "A large integer");
  table.add("part.gain", fields.gain, 0, 1, "m", "A number");
  table.add("word", fields.word, {}, "A text");
  table.add("fabric", fields.fabric, {"wool", "silk"}, "A choice");
  table.add("deep.part.list", fields.list, -5, 5, "m", "Numbers");
  table.add("device", fields.device,
            {{"cpu", atelier::Device::Cpu}, {"cuda", atelier::Device::Cuda}}, "An enumeration");
  return table;
}

/// Whatever was given, the values are in their ranges and their texts read back.
void check(atelier::OptionTable& table) {
  ATELIER_CHECK(atelier::check_options(table).empty(), "a value out of its range was set");
  const std::string before = atelier::canonical_json(table);
  for (const atelier::OptionField& field : std::vector<atelier::OptionField>(table.fields)) {
    const std::string text = atelier::option_text(field);
    ATELIER_CHECK(atelier::set_option(table, field.name, text).empty(),
                  field.name + " does not read back");
  }
  ATELIER_CHECK(atelier::canonical_json(table) == before, "a value changed by reading it back");
}

}  // namespace

/// The text as command-line flags, one `name=value` a line, and then as an options file.
ATELIER_FUZZ_READER(options) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  Fields fields;
  atelier::OptionTable table = table_of(fields);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    const std::size_t equals = std::min(line.find('='), line.size());
    const std::string value(line.substr(std::min(equals + 1, line.size())));
    atelier::set_option(table, std::string(line.substr(0, equals)), value);
    atelier::FrameSelection selection;
    atelier::set_frames(selection, value);
    atelier::set_shard(selection, value);
    ATELIER_CHECK(selection.shard >= 0 && selection.shard < selection.shards, "no such shard");
    atelier::selected_frames(selection, {0, 1, 5});
    begin = end + 1;
  }
  check(table);
  atelier::set_options_from_toml(table, text, "options");
  check(table);
}
