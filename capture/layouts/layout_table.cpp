#include "capture/layouts/layout_table.h"

#include <algorithm>
#include <array>

#include "capture/layouts/actorshq.h"
#include "capture/layouts/avatarrex.h"
#include "capture/layouts/camera_toml.h"
#include "capture/layouts/colmap.h"
#include "capture/layouts/dna.h"
#include "capture/layouts/easymocap.h"
#include "capture/layouts/goliath.h"
#include "capture/layouts/human36m.h"
#include "capture/layouts/images.h"
#include "capture/layouts/mvhumannet.h"
#include "capture/layouts/native.h"
#include "capture/layouts/nerfstudio.h"
#include "capture/layouts/panoptic.h"
#include "capture/layouts/qualisys.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr std::array kLayouts = {
    Layout{"native", "our own: capture.toml, cameras.json, images/<camera>/<frame>.png",
           recognize_native, read_native, write_native},
    Layout{"easymocap", "EasyMocap and ZJU-MoCap: intri.yml, extri.yml, images/<camera>/",
           recognize_easymocap, read_easymocap, write_easymocap},
    Layout{"goliath", "Goliath and Ava-256: camera_calibration.json (KRT), image/cam<ID>.zip",
           recognize_goliath, read_goliath, write_goliath},
    Layout{"actorshq", "ActorsHQ: 1x/calibration.csv, rgbs/CamXXX/", recognize_actorshq,
           read_actorshq, write_actorshq},
    Layout{"dna", "DNA-Rendering: main/<id>.smc, annotations/<id>_annots.smc", recognize_dna,
           read_dna, write_dna},
    Layout{"mvhumannet",
           "MVHumanNet: camera_extrinsics.json, camera_intrinsics.json, images/<camera>/",
           recognize_mvhumannet, read_mvhumannet, write_mvhumannet},
    Layout{"avatarrex", "AvatarReX: calibration_full.json, <camera>/%08d.jpg", recognize_avatarrex,
           read_avatarrex, write_avatarrex},
    Layout{"panoptic", "CMU Panoptic: calibration_<sequence>.json, hdImgs/ or hdVideos/",
           recognize_panoptic, read_panoptic, write_panoptic},
    Layout{"human36m", "Human3.6M: camera-parameters.json, images/<camera>/", recognize_human36m,
           read_human36m, write_human36m},
    Layout{"colmap", "COLMAP, text: sparse/0/cameras.txt, images.txt", recognize_colmap_text,
           read_colmap_text, write_colmap_text, "sparse/0/test.txt"},
    Layout{"colmap_binary", "COLMAP, binary: sparse/0/cameras.bin, images.bin",
           recognize_colmap_binary, read_colmap_binary, write_colmap_binary, "sparse/0/test.txt"},
    Layout{"nerfstudio", "nerfstudio and NeRF: transforms.json, images/", recognize_nerfstudio,
           read_nerfstudio, write_nerfstudio, "test_filenames of transforms.json"},
    Layout{"caliscope", "Caliscope: camera_array.toml, or config.toml with [cam_0]",
           recognize_caliscope, read_caliscope, write_caliscope},
    Layout{"pose2sim", "Pose2Sim: calibration/Calib*.toml, videos/, pose/<camera>_json/",
           recognize_pose2sim, read_pose2sim, write_pose2sim},
    Layout{"qualisys", "Qualisys QTM: *.qca.txt, videos/", recognize_qualisys, read_qualisys,
           write_qualisys},
    Layout{"anipose", "anipose: calibration.toml with [cam_0]", recognize_anipose, read_anipose,
           write_anipose},
    Layout{"thuman4", "THuman4.0: calibration.json, images/<camera>/", recognize_thuman4,
           read_thuman4, write_thuman4},
    Layout{"images", "images alone, not calibrated: images/<camera>/, <camera>.zip or <camera>.mp4",
           recognize_images, read_images, write_images},
};

}  // namespace

std::span<const Layout> all_layouts() {
  return kLayouts;
}

const Layout& find_layout(const std::string& name) {
  const auto found = std::find_if(kLayouts.begin(), kLayouts.end(),
                                  [&](const Layout& layout) { return layout.name == name; });
  ATELIER_CHECK(found != kLayouts.end(), "no layout is called " + name);
  return *found;
}

}  // namespace atelier
