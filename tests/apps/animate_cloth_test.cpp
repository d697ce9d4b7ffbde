// What `animate` says of cloth that is hardly to be trusted, its own and that of other simulators;
// and that it hears signals before its first frame.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include "core/io/mesh_file.h"
#include "tests/apps/animate_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class AnimateCloth : public Animate {
 protected:
  void SetUp() override {
    Animate::SetUp();
    if (!IsSkipped()) {
      write_dressed_workspace(capture(), workspace());
    }
  }
  std::vector<std::string> warnings() const {
    return nlohmann::json::parse(read_file_text(result() / "manifest.json", 1 << 20))
        .value("warnings", std::vector<std::string>{});
  }
  ChildResult foreign(const fs::path& cloth) const {
    return animate({"--cloth-sequence", cloth.string()});
  }
};

TEST_F(AnimateCloth, OverstretchedCloth_IsWarnedOfWithWorstFrame) {
  ASSERT_EQ(animate().exit_code, 0);
  EXPECT_THAT(warnings(), Not(Contains(HasSubstr("stretched"))));
  const ChildResult done =
      animate({"--motion", motion(person_clip()).string(), "--material.stretch-warp", "14",
               "--material.stretch-weft", "14", "--material.density", "1"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err, HasSubstr("the cloth is stretched by"));
  EXPECT_THAT(warnings(),
              Contains(AllOf(ContainsRegex("95th percentile, frame [0-4]\\)"),
                             HasSubstr("--cloth.xpbd.substeps"), HasSubstr("--cloth.contact"))));
}

TEST_F(AnimateCloth, ForeignClothInsideTheBody_IsWarnedOfWithWorstFrame) {
  ASSERT_EQ(foreign(workspace() / "register" / "current" / "registered" / "lower").exit_code, 0);
  EXPECT_THAT(warnings(), IsEmpty());
  fs::create_directories(root_ / "cloth");
  for (int i = 0; i < 3; ++i) {
    Mesh skirt = tube_skirt().mesh;
    skirt.vertices = walking_skirt()[static_cast<std::size_t>(i)];
    if (i == 1) {  // its waist is drawn into the trunk
      skirt.vertices.topRows(20).col(0) *= 0.7;
    }
    write_mesh(root_ / "cloth" / ("cloth_" + std::to_string(i) + ".obj"), skirt);
  }
  const ChildResult done = foreign(root_ / "cloth");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(warnings(), Contains(AllOf(HasSubstr("vertices are inside the body, up to"),
                                         HasSubstr("(frame 1)"))));
  EXPECT_THAT(warnings(), Not(Contains(HasSubstr("--cloth")))) << "no option of ours helps";
}

TEST_F(AnimateCloth, ExportedCloth_IsAcceptedAgain) {
  // As `register` leaves it: the template beside the frames.
  const fs::path out = root_ / "out";
  for (const char* format : {"ply", "obj", "h5", "glb"}) {
    const ChildResult exported = run({"export", workspace().string(), (out / format).string(),
                                      "--stage", "register", "--format", format});
    ASSERT_EQ(exported.exit_code, 0) << exported.err;
  }
  const auto exported = [&](const std::string& format, const std::string& name) {
    return out / format / "register" / "registered" / name;
  };
  for (const char* format : {"ply", "obj"}) {
    const fs::path folder = exported(format, "lower");
    write_mesh(folder / ("template." + std::string(format)), tube_skirt().mesh);
    const ChildResult done = foreign(folder);
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(metrics()["frames"], 3);
    const Sequence skirt = open_sequence(result() / "garments" / "lower");
    EXPECT_LT((frame(skirt, 2).vertices - walking_skirt()[2]).cwiseAbs().maxCoeff(), 1e-5);
  }
  const ChildResult one_file = foreign(exported("h5", "lower.h5"));
  EXPECT_EQ(one_file.exit_code, 0) << one_file.err;
  // A file that is neither is still asked about.
  write_mesh(exported("ply", "lower") / "rest.ply", tube_skirt().mesh);
  EXPECT_THAT(foreign(exported("ply", "lower")).err, HasSubstr("no frame number at its end"));
}

TEST_F(AnimateCloth, OtherTopology_IsRefusedWithWhatWouldFit) {
  write_mesh(root_ / "cloth_0.obj", grid(3, 3));
  const ChildResult refused = foreign(root_ / "cloth_0.obj");
  EXPECT_EQ(refused.exit_code, 3);
  for (const char* words : {"the 240 faces of lower", "registered/lower (--format ply or obj)",
                            "registered/lower.h5 (--format h5)", "--garment none"}) {
    EXPECT_THAT(refused.err, HasSubstr(words));
  }
}

TEST_F(AnimateCloth, SignalBeforeTheFirstFrame_StopsTheRun) {
  // Sixty thousand steps of hanging: minutes of work.
  const fs::path said = root_ / "said.txt";
  for (const int signal : {SIGINT, SIGTERM}) {
    ChildProcess child({"/bin/sh", "-c", R"(exec "$@" > ")" + said.string() + "\"", "sh",
                        program_path(), "animate", capture().string(), workspace().string(),
                        "--motion", motion(person_clip()).string(), "--pictures", "false",
                        "--settle", "60", "--cloth.rate", "1000", "--json", "--jobs", "2"});
    while (!child.has_ended() &&
           !(fs::exists(said) &&
             read_file_text(said, 1 << 26).find("steps before the first") != std::string::npos)) {
      usleep(1000);
    }
    child.kill(signal);
    const ChildResult result = child.wait();
    EXPECT_EQ(result.signal, signal) << result.err;
    const std::string all = read_file_text(said, 1 << 26);
    const auto end = nlohmann::json::parse(all.substr(all.rfind('\n', all.size() - 2) + 1));
    EXPECT_EQ(end["end"], "stopped");
    EXPECT_EQ(end["frames_kept"], 0);
    EXPECT_FALSE(fs::exists(this->result()));
  }
}

}  // namespace
}  // namespace atelier::fixtures

#endif
