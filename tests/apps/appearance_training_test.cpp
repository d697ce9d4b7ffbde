// `atelier-appearance train`: checkpoints, kills, and what it refuses.
#if defined(ATELIER_HAS_CAPTURE)

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/atomic_file.h"
#include "core/io/safetensors.h"
#include "core/tensor.h"
#include "tests/apps/appearance_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(Appearance, KilledTraining_ResumesBitIdentical) {
  ASSERT_EQ(oracle("ws").exit_code, 0);
  ASSERT_EQ(run_child(train("whole.safetensors", "whole.checkpoint")).exit_code, 0);
  {
    const ChildProcess half(train("half.safetensors", "half.checkpoint"));
    while (!fs::exists(folder_ / "half.checkpoint") && !half.has_ended()) {
      std::this_thread::yield();
    }
    half.kill(SIGKILL);
  }
  ASSERT_TRUE(fs::exists(folder_ / "half.checkpoint"));
  std::ofstream(folder_ / "half.safetensors.csv", std::ios::app) << "5";  // of "57,...": torn
  ASSERT_EQ(run_child(train("half.safetensors", "half.checkpoint")).exit_code, 0);
  EXPECT_EQ(bytes_of(folder_ / "half.safetensors"), bytes_of(folder_ / "whole.safetensors"));
  EXPECT_EQ(bytes_of(folder_ / "half.safetensors.csv"),
            bytes_of(folder_ / "whole.safetensors.csv"));
  std::vector<std::string> diverging = train("diverged.safetensors", "diverged.checkpoint");
  diverging.insert(diverging.end(), {"--learning-rate", "1"});
  const ChildResult diverged = run_child(diverging);
  EXPECT_EQ(diverged.exit_code, 4) << diverged.err;
  EXPECT_THAT(diverged.err, HasSubstr("below the"));
  EXPECT_FALSE(fs::exists(folder_ / "diverged.safetensors"));
  // Of another architecture, with a flipped bit, and cut off.
  ChildResult refused = run_child(train("x.safetensors", "whole.checkpoint", "3"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("channels"));
  flip_last_bit(folder_ / "half.checkpoint");
  refused = run_child(train("x.safetensors", "half.checkpoint"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("half.checkpoint"));
  EXPECT_THAT(refused.err, HasSubstr("damaged"));
  EXPECT_THAT(refused.err, HasSubstr("remove that file, or give --force"));
  // What is no checkpoint is not to be removed: a finished network, and somebody's file.
  refused = run_child(train("x.safetensors", "whole.safetensors"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("whole.safetensors: a finished network"));
  EXPECT_THAT(refused.err, HasSubstr("name another --checkpoint"));
  EXPECT_THAT(refused.err, Not(HasSubstr("remove")));
  write_file_atomically(folder_ / "notes.txt", "a line that is long enough\n");
  refused = run_child(train("x.safetensors", "notes.txt"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("notes.txt: no checkpoint"));
  EXPECT_THAT(refused.err, Not(HasSubstr("remove")));
  fs::resize_file(folder_ / "half.checkpoint", fs::file_size(folder_ / "half.checkpoint") - 9);
  refused = run_child(train("x.safetensors", "half.checkpoint"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("half.checkpoint"));
  EXPECT_FALSE(fs::exists(folder_ / "x.safetensors"));
}

std::string text_at(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// The process of a rank among those that `starter` has started.
pid_t process_of_rank(pid_t starter, int rank) {
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc")) {
    const std::string words = text_at(entry.path() / "cmdline");
    const std::string status = text_at(entry.path() / "status");
    if (status.find("PPid:\t" + std::to_string(starter) + "\n") != std::string::npos &&
        words.find(std::string("--rank") + '\0' + std::to_string(rank)) != std::string::npos) {
      return std::stoi(entry.path().filename().string());
    }
  }
  return 0;
}

TEST_F(Appearance, ProcessesTogether_GoOnAfterALostOneWithAnyNumber) {
  ASSERT_EQ(oracle("ws").exit_code, 0);
  const auto together = [&](const char* model, const char* checkpoint, const char* processes) {
    std::vector<std::string> words = train(model, checkpoint);
    words.insert(words.end(), {"--processes", processes});
    return words;
  };
  const ChildResult whole = run_child(together("whole.safetensors", "whole.checkpoint", "2"));
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(whole.out, HasSubstr("step 60 60 "));
  EXPECT_EQ(whole.err, "");
  {
    ChildProcess half(together("half.safetensors", "half.checkpoint", "2"));
    while (!fs::exists(folder_ / "half.checkpoint") && !half.has_ended()) {
      std::this_thread::yield();
    }
    const pid_t second = process_of_rank(half.pid(), 1);
    ASSERT_GT(second, 0);
    ::kill(second, SIGKILL);
    const ChildResult lost = half.wait();
    EXPECT_EQ(lost.exit_code, 5) << lost.err;
    EXPECT_THAT(lost.err, HasSubstr("process 1 of 2 is lost"));
    EXPECT_EQ(std::count(lost.err.begin(), lost.err.end(), '\n'), 1) << lost.err;
  }
  EXPECT_FALSE(fs::exists(folder_ / "half.safetensors"));
  for (const char* processes : {"3", "1"}) {
    const ChildResult rest = run_child(together("half.safetensors", "half.checkpoint", processes));
    EXPECT_EQ(rest.exit_code, 0) << rest.err;
  }
  EXPECT_TRUE(fs::exists(folder_ / "half.safetensors"));
}

TEST_F(Appearance, ProcessesThatCannotMeet_AreRefused) {
  ASSERT_EQ(oracle("ws").exit_code, 0);
  const auto refused = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = train("x.safetensors", "x.checkpoint");
    words.insert(words.end(), more.begin(), more.end());
    return run_child(words);
  };
  const ChildResult launcher = refused({"--launcher", "torchrun"});
  EXPECT_EQ(launcher.exit_code, 5) << launcher.err;
  EXPECT_THAT(launcher.err, HasSubstr("WORLD_SIZE: not set"));
  EXPECT_EQ(refused({"--processes", "0"}).exit_code, 2);
  EXPECT_EQ(refused({"--processes", "2", "--launcher", "slurm"}).exit_code, 2);
  EXPECT_EQ(refused({"--rank", "1", "--rendezvous", "x"}).exit_code, 2);
  EXPECT_EQ(refused({"--rank", "0", "--processes", "2"}).exit_code, 2);
}

TEST_F(Appearance, KilledStage_ResumesWithItsPreparedData) {
  const std::vector<std::string> longer = {"--iterations", "120"};
  ASSERT_EQ(oracle("whole", longer).exit_code, 0);
  const fs::path stage = folder_ / "killed" / "oracle";
  const auto left = [&] {  // the file of a training that has begun
    for (const fs::path& file : all_files(stage)) {
      if (file.filename() == "checkpoint.safetensors") {
        return file;
      }
    }
    return fs::path();
  };
  {
    const ChildProcess half(learning("oracle", capture_, folder_ / "killed", longer));
    while (left().empty() && !half.has_ended()) {
      std::this_thread::yield();
    }
    half.kill(SIGKILL);
  }
  ASSERT_FALSE(left().empty());
  const fs::path data = left().parent_path() / "data.h5";
  const std::string prepared = bytes_of(data);
  // A damaged checkpoint inside of a stage is nobody's to take away.
  const fs::path checkpoint = left();
  flip_last_bit(checkpoint);
  const ChildResult damaged = oracle("killed", longer);
  EXPECT_EQ(damaged.exit_code, 3) << damaged.err;
  EXPECT_THAT(damaged.err, HasSubstr("give --force to train from the beginning"));
  EXPECT_THAT(damaged.err, Not(HasSubstr("remove that file")));
  flip_last_bit(checkpoint);
  const ChildResult again = oracle("killed", longer);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("continuing with the data prepared before"));
  EXPECT_EQ(bytes_of(result("killed", "data.h5")), prepared);
  for (const char* file : {"data.h5", "model.safetensors", "training.csv"}) {
    EXPECT_EQ(bytes_of(result("killed", file)), bytes_of(result("whole", file))) << file;
  }
}

TEST_F(Appearance, NonFiniteLoss_KeepsTheLastCheckpoint) {
  ASSERT_EQ(oracle("ws").exit_code, 0);
  {
    const ChildProcess half(train("half.safetensors", "half.checkpoint"));
    while (!fs::exists(folder_ / "half.checkpoint") && !half.has_ended()) {
      std::this_thread::yield();
    }
    half.kill(SIGKILL);
  }
  // A moment that the next step cannot survive.
  const fs::path checkpoint = folder_ / "half.checkpoint";
  Safetensors state = read_safetensors(checkpoint);
  const std::string steps = state.metadata.at("iteration");
  state.metadata.erase("digest");  // the network is not damaged, it diverges
  for (auto& [name, tensor] : state.tensors) {
    if (name.starts_with("moment.m.")) {
      tensor = tensor_of(std::vector<float>(static_cast<std::size_t>(element_count(tensor)), 3e38F),
                         tensor.shape);
    }
  }
  write_safetensors(checkpoint, state);
  const std::string before = bytes_of(checkpoint);
  const ChildResult broken = run_child(train("x.safetensors", "half.checkpoint"));
  EXPECT_EQ(broken.exit_code, 4) << broken.err;
  EXPECT_THAT(broken.err, HasSubstr("no number any more after iteration " + steps +
                                    ", where the checkpoint stands"));
  EXPECT_EQ(bytes_of(checkpoint), before);
  EXPECT_FALSE(fs::exists(folder_ / "x.safetensors"));
}

TEST_F(Appearance, Training_ReplacesOnlyItsOwnFiles) {
  const std::string data = (folder_ / "data.h5").string();
  const std::string model = (folder_ / "m.safetensors").string();
  const std::string notes = (folder_ / "notes.txt").string();
  const std::string link = (folder_ / "link.csv").string();
  const std::string pipe = (folder_ / "pipe").string();
  write_file_atomically(data, "not read yet");
  write_file_atomically(notes, "kept\n");
  fs::create_symlink("notes.txt", link);
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const auto train = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {network_program().string(), "train"});
    return run_child(words);
  };
  const std::string same = (folder_ / "." / "data.h5").string();
  for (const ChildResult& refused : {train({data, same}), train({data, model, "--log", same})}) {
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr("DATA and"));
    EXPECT_THAT(refused.err, HasSubstr("are one file"));
  }
  EXPECT_EQ(train({data, model, "--log", notes, "--checkpoint", notes}).exit_code, 2);
  for (const std::string& place : {link, pipe, std::string("/dev/null")}) {
    const ChildResult refused = train({data, model, "--log", place});
    EXPECT_EQ(refused.exit_code, 3) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr("expected a regular file"));
  }
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_TRUE(fs::is_symlink(link));
  ChildResult refused = train({data, model, "--log", notes});
  EXPECT_EQ(refused.exit_code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("no log of a training"));
  // Somebody's file in the network's place, and in that of colours.
  refused = train({data, notes});
  EXPECT_EQ(refused.exit_code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("notes.txt: no network, and it would be replaced"));
  refused = run_child({network_program().string(), "predict", model, data, notes});
  EXPECT_EQ(refused.exit_code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("no archive of colours, and it would be replaced"));
  EXPECT_EQ(bytes_of(notes), "kept\n");
  // Before the data are read, which are none here.
  refused = train({data, (folder_ / "missing" / "m.safetensors").string()});
  EXPECT_EQ(refused.exit_code, 5) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("create it first"));
  EXPECT_EQ(bytes_of(data), "not read yet");
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they need the address space
TEST_F(Appearance, TrainingOutOfMemory_SaysWhatTakesLess) {
  const ChildResult made = oracle("ws", {"--iterations", "1"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string model = (folder_ / "m.safetensors").string();
  const ChildResult refused =
      run_child({"bash", "-c",
                 "ulimit -v 1500000; exec '" + network_program().string() + "' train '" +
                     (folder_ / "ws" / "oracle" / "current" / "cloth" / "data.h5").string() +
                     "' '" + model + "' --resolution 2048 --shading 1"});
  EXPECT_EQ(refused.exit_code, 5) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("memory: there is not enough; a network takes less with"));
  EXPECT_FALSE(fs::exists(model));
}
#endif

TEST_F(Appearance, FileCommands_TakeTheirOwnOptionsOnly) {
  const std::string program = network_program().string();
  const ChildResult refused = run_child({program, "predict", "m", "d", "c", "--iterations", "3"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("iterations"));
  const ChildResult twice =
      run_child({program, "train", "d", "m", "--weight-decay", "1", "--weight_decay", "0.5"});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_THAT(twice.err, HasSubstr("--weight_decay is given twice"));
  const ChildResult help = run_child({program, "train", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("--weight_decay <"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
