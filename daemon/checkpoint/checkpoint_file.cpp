#include "daemon/checkpoint/checkpoint_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <system_error>
#include <type_traits>
#include <utility>

#include "drivers/device/byte_cursor.hpp"
#include "drivers/file/descriptor.hpp"
#include "drivers/recording/crc32.hpp"

namespace perimap {
namespace {

constexpr std::string_view kMagic = "PERIMAPC";
constexpr std::uint32_t kFormat = 8;
constexpr std::size_t kHeader = 16;
constexpr std::size_t kLongestText = 4096;
constexpr std::uint32_t kMostFeatures = 4096;
constexpr std::uint32_t kMostBlocks = 65536;
static_assert(std::is_trivially_copyable_v<PatchTemplate>);
static_assert(std::endian::native == std::endian::little, "a template is kept as it lies in memory");

class Bytes {
 public:
  template <class T>
  Bytes& add(T value) {
    static_assert(std::is_arithmetic_v<T>);
    return raw(&value, sizeof value);
  }
  Bytes& add(const std::string& text) {
    add(static_cast<std::uint32_t>(text.size()));
    return raw(text.data(), text.size());
  }
  Bytes& add(Instant t) { return add(to_ns(t)); }
  Bytes& raw(const void* data, std::size_t size) {
    bytes_.append(static_cast<const char*>(data), size);
    return *this;
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads what Bytes wrote. The first thing that is wrong stays what is told.
class Reader {
 public:
  explicit Reader(std::string_view bytes)
      : cursor_(std::as_bytes(std::span(bytes.data(), bytes.size()))), size_(bytes.size()) {}

  [[nodiscard]] bool good() const { return error_.empty(); }
  [[nodiscard]] tl::unexpected<Error> error() const { return fail(error_); }
  [[nodiscard]] std::size_t left() const { return cursor_.left(); }

  void expect(bool true_thing, std::string_view what) {
    if (!good()) return;
    if (!cursor_.good()) {
      error_ = fmt::format("byte {}: expected {}, got the end", size_, what);
    } else if (!true_thing) {
      error_ = fmt::format("byte {}: expected {}", size_ - cursor_.left(), what);
    }
  }
  template <class T>
  T number(std::string_view what) {
    if constexpr (std::is_same_v<T, double>) {
      const double value = std::bit_cast<double>(cursor_.number<std::uint64_t>());
      expect(std::isfinite(value), what);
      return good() ? value : 0.0;
    } else {
      const auto value = static_cast<T>(cursor_.number<std::make_unsigned_t<T>>());
      expect(true, what);
      return good() ? value : T{0};
    }
  }
  float float32(std::string_view what) {
    const float value = cursor_.float32();
    expect(true, what);
    return value;
  }
  // So bounded that sums and differences of two are instants too.
  Instant instant(std::string_view what) {
    constexpr std::int64_t kFurthest = std::int64_t{1} << 61;
    const auto ns = number<std::int64_t>(what);
    expect(ns >= -kFurthest && ns <= kFurthest, what);
    return from_ns(good() ? ns : 0);
  }
  bool flag(std::string_view what) {
    const auto byte = number<std::uint8_t>(what);
    expect(byte <= 1, what);
    return good() && byte == 1;
  }
  std::uint32_t count(std::uint32_t most, std::size_t least_bytes_each, std::string_view what) {
    const auto n = number<std::uint32_t>(what);
    expect(n <= most && n * std::uint64_t{least_bytes_each} <= cursor_.left(), what);
    return good() ? n : 0;
  }
  std::string text(std::string_view what) {
    const std::uint32_t n = count(kLongestText, 1, what);
    const auto bytes = cursor_.read_bytes(n);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  void raw(void* data, std::size_t size, std::string_view what) {
    const auto bytes = cursor_.read_bytes(size);
    expect(bytes.size() == size, what);
    if (good()) std::memcpy(data, bytes.data(), size);
  }

 private:
  ByteCursor<std::endian::little> cursor_;
  std::size_t size_;
  std::string error_;
};

bool is_flag(const bool& flag) {
  unsigned char byte = 0;
  std::memcpy(&byte, &flag, 1);
  return byte <= 1;
}

// What the search relies on: the sides are its loops' limits, the offsets its places in the image.
bool is_sound(const PatchTemplate& patch) {
  if (!is_flag(patch.affine_usable)) return false;
  for (std::size_t l = 0; l < patch.levels.size(); ++l) {
    const PatchTemplate::Level& level = patch.levels[l];
    if (!is_flag(level.usable)) return false;
    if (!level.usable) continue;
    const auto small = [](double x) { return std::abs(x) <= 0.5; };
    const auto finite = [](const auto& values) {
      return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
    };
    if (level.side != PatchTemplate::kSide[l] || !small(level.offset_x) || !small(level.offset_y) ||
        !std::isfinite(level.mean) || !std::isfinite(level.sum_squares) || !finite(level.sd_mean) ||
        !finite(level.sd_on_grey) || !finite(level.translation_inverse)) {
      return false;
    }
  }
  return std::all_of(patch.affine_inverse.begin(), patch.affine_inverse.end(),
                     [](double x) { return std::isfinite(x); });
}

FeatureMemory read_feature(Reader& in, int state_size) {
  FeatureMemory feature;
  feature.id = in.number<std::uint32_t>("a feature's number");
  feature.first_observed = in.instant("when it was first observed");
  feature.first_observed_px.x() = in.number<double>("where it was first observed");
  feature.first_observed_px.y() = in.number<double>("where it was first observed");
  feature.last_observed = in.instant("when it was last observed");
  in.raw(&feature.patch, sizeof feature.patch, "a template");
  if (in.good()) in.expect(is_sound(feature.patch), "a sound template");
  if (!in.good()) feature.patch = PatchTemplate{};
  PatchState& state = feature.patch_state;
  for (double* x : {&state.px.x(), &state.px.y(), &state.A(0, 0), &state.A(0, 1), &state.A(1, 0), &state.A(1, 1),
                    &state.gain, &state.bias}) {
    *x = in.number<double>("how it looked when it was last found");
  }
  feature.updates = in.number<std::int32_t>("its updates");
  feature.converged = in.flag("whether it has converged");
  feature.breathing = in.flag("whether breathing is in it");
  feature.largest_deviation_mm = in.number<double>("its largest deviation");
  in.expect(feature.updates >= 0 && feature.largest_deviation_mm >= 0.0 && feature.id > 0, "a feature's figures");
  feature.estimate.x.resize(state_size);
  feature.estimate.P.resize(state_size, state_size);
  for (int i = 0; i < state_size && in.good(); ++i) feature.estimate.x(i) = in.number<double>("a coefficient");
  for (int i = 0; i < state_size && in.good(); ++i) {
    for (int k = 0; k <= i && in.good(); ++k) {
      feature.estimate.P(i, k) = feature.estimate.P(k, i) = in.number<double>("a covariance");
    }
    in.expect(feature.estimate.P(i, i) >= 0.0, "a variance");
  }
  return feature;
}

EcgBlock read_block(Reader& in) {
  EcgBlock block;
  block.first_sample_time = in.instant("an ECG block's time");
  block.arrival = block.first_sample_time;
  block.sample_period = Duration(in.number<std::int64_t>("an ECG block's period"));
  block.lead_off = in.flag("whether the lead was off");
  block.count = in.number<std::uint32_t>("an ECG block's samples");
  in.expect(block.count <= EcgBlock::kCapacity && block.sample_period > Duration(0), "an ECG block");
  if (!in.good()) return {};
  for (std::uint32_t i = 0; i < block.count; ++i) block.mV[i] = in.float32("an ECG sample");
  block.has_second = in.flag("whether there is a second lead");
  if (!block.has_second || !in.good()) return block;
  block.second_off = in.flag("whether the second lead was off");
  for (std::uint32_t i = 0; i < block.count; ++i) block.second_mV[i] = in.float32("a sample of the second lead");
  return block;
}

void add_respiration(Bytes& out, const RespirationMemory& respiration) {
  out.add(static_cast<std::uint8_t>(respiration.found));
  for (const auto& coefficients : {respiration.wave.a, respiration.wave.b}) {
    for (const Eigen::Vector3d& coefficient : coefficients) {
      for (const double x : coefficient) out.add(x);
    }
  }
  const RespiratoryClock& clock = respiration.clock;
  out.add(static_cast<std::uint8_t>(clock.state)).add(static_cast<std::uint8_t>(clock.suspected)).add(clock.time);
  for (const double x : {clock.phase_rad, clock.rate_rad_per_s, clock.phase_variance_rad2, clock.covariance_rad2_per_s,
                         clock.rate_variance_rad2_per_s2}) {
    out.add(x);
  }
  out.add(static_cast<std::uint8_t>(respiration.offset_known)).add(respiration.offset_rad);
}

// What is not kept is the new run's own: its settings, and what follows from the wave.
RespirationMemory read_respiration(Reader& in) {
  RespirationMemory respiration;
  respiration.found = in.flag("whether breathing was found");
  for (auto* coefficients : {&respiration.wave.a, &respiration.wave.b}) {
    for (Eigen::Vector3d& coefficient : *coefficients) {
      for (double& x : coefficient) x = in.number<double>("how breathing displaces the surface");
    }
  }
  RespiratoryClock& clock = respiration.clock;
  const auto state = in.number<std::uint8_t>("what is known of breathing");
  in.expect(state <= static_cast<std::uint8_t>(RespirationState::kLocked), "what is known of breathing");
  if (in.good()) clock.state = static_cast<RespirationState>(state);
  in.expect(respiration.found || clock.state != RespirationState::kLocked, "what is known of breathing");
  clock.suspected = in.flag("whether breathing is suspected");
  clock.time = in.instant("when the breath's phase was known");
  for (double* x : {&clock.phase_rad, &clock.rate_rad_per_s, &clock.phase_variance_rad2, &clock.covariance_rad2_per_s,
                    &clock.rate_variance_rad2_per_s2}) {
    *x = in.number<double>("the breath's phase and rate");
  }
  // Rounding may leave a filter's covariance a little beyond.
  const double square = clock.covariance_rad2_per_s * clock.covariance_rad2_per_s;
  in.expect(clock.phase_variance_rad2 >= 0.0 && clock.rate_variance_rad2_per_s2 >= 0.0 &&
                square <= 1.000001 * clock.phase_variance_rad2 * clock.rate_variance_rad2_per_s2,
            "a covariance of the breath's phase and rate");
  respiration.offset_known = in.flag("whether the respiration channel was heard");
  respiration.offset_rad = in.number<double>("where the respiration channel's phase begins");
  return respiration;
}

void add_law(Bytes& out, const LawMemory& law) {
  out.add(static_cast<std::uint8_t>(law.law)).add(law.usual.count()).add(law.cycles);
  for (const double x : law.squares) out.add(x);
  for (const double x : law.log_likelihoods) out.add(x);
}

LawMemory read_law(Reader& in) {
  constexpr double kLongestCycle_s = 10.0;
  LawMemory law;
  const auto index = in.number<std::uint8_t>("the law of the motion");
  in.expect(index < kPhaseLaws.size(), "the law of the motion");
  if (in.good()) law.law = kPhaseLaws[index];
  law.usual = Seconds(in.number<double>("the usual length of a cycle"));
  in.expect(law.usual.count() >= 0.0 && law.usual.count() <= kLongestCycle_s, "the usual length of a cycle");
  law.cycles = in.number<double>("the cycles weighed");
  in.expect(law.cycles >= 0.0, "the cycles weighed");
  for (double& x : law.squares) {
    x = in.number<double>("a law's scatter");
    in.expect(x >= 0.0, "a law's scatter");
  }
  for (double& x : law.log_likelihoods) {
    x = in.number<double>("a law's likelihood");
    in.expect(x <= 0.0, "a law's likelihood");
  }
  return law;
}

void add_setup(Bytes& out, const SetupMemory& setup) {
  const SetupVerdict& told = setup.told;
  out.add(static_cast<std::uint8_t>(setup.asked)).add(static_cast<std::uint8_t>(setup.doubted));
  out.add(setup.widening_mm).add(setup.widened_at_mm);
  out.add(static_cast<std::uint8_t>(told.state));
  for (const bool blamed : told.blamed) out.add(static_cast<std::uint8_t>(blamed));
  for (const SetupVector& numbers :
       {told.deviation, told.uncertainty, told.blamed_deviation, told.blamed_uncertainty}) {
    for (const double x : numbers) out.add(x);
  }
  out.add(told.surface_mm).add(told.surface_deviation_mm).add(told.widening_mm);
}

// What is not kept says how a window came to its verdict, which nobody asks later.
SetupMemory read_setup(Reader& in) {
  SetupMemory setup;
  SetupVerdict& told = setup.told;
  const auto length = [&in](std::string_view what) {
    const auto mm = in.number<double>(what);
    in.expect(mm >= 0.0, what);
    return mm;
  };
  setup.asked = in.flag("whether the set-up was asked");
  setup.doubted = in.flag("whether the set-up was doubted");
  setup.widening_mm = length("what the set-up may be off by");
  setup.widened_at_mm = length("how well the surface was known");
  const auto state = in.number<std::uint8_t>("what is believed of the set-up");
  in.expect(state <= static_cast<std::uint8_t>(SetupState::kDoubted) &&
                setup.doubted == (state == static_cast<std::uint8_t>(SetupState::kDoubted)),
            "what is believed of the set-up");
  in.expect(setup.asked || !setup.doubted, "what is believed of the set-up");
  if (in.good()) told.state = static_cast<SetupState>(state);
  for (bool& blamed : told.blamed) blamed = in.flag("what of the set-up was blamed");
  for (SetupVector* numbers : {&told.deviation, &told.uncertainty, &told.blamed_deviation, &told.blamed_uncertainty}) {
    for (double& x : *numbers) x = in.number<double>("a number of the set-up");
  }
  told.surface_mm = length("how far the surface was off");
  told.surface_deviation_mm = length("how well that was known");
  told.widening_mm = length("what the doubt had widened");
  return setup;
}

std::filesystem::path part_of(const std::filesystem::path& file) { return file.string() + ".part"; }

// What its folder lists is on the disk. A file system that cannot do that has done what it can.
void synchronise_folder(const std::filesystem::path& file) {
  const Descriptor folder(
      open(file.has_parent_path() ? file.parent_path().c_str() : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder) static_cast<void>(fsync(folder.get()));
}

std::string system_message() { return std::generic_category().message(errno); }

}  // namespace

std::string serialize_feature(const FeatureMemory& feature) {
  Bytes out;
  out.add(feature.id).add(feature.first_observed).add(feature.first_observed_px.x()).add(feature.first_observed_px.y());
  out.add(feature.last_observed).raw(&feature.patch, sizeof feature.patch);
  const PatchState& state = feature.patch_state;
  for (const double x : {state.px.x(), state.px.y(), state.A(0, 0), state.A(0, 1), state.A(1, 0), state.A(1, 1),
                         state.gain, state.bias}) {
    out.add(x);
  }
  out.add(std::int32_t{feature.updates})
      .add(static_cast<std::uint8_t>(feature.converged))
      .add(static_cast<std::uint8_t>(feature.breathing));
  out.add(feature.largest_deviation_mm);
  const FeatureEstimate& estimate = feature.estimate;
  for (const double x : estimate.x) out.add(x);
  for (Eigen::Index i = 0; i < estimate.P.rows(); ++i) {
    for (Eigen::Index k = 0; k <= i; ++k) out.add(double{estimate.P(i, k)});
  }
  return out.take();
}

std::string serialize(const Checkpoint& checkpoint, std::span<const std::string> features) {
  Bytes body;
  body.add(std::string(PERIMAP_VERSION)).add(static_cast<std::uint32_t>(sizeof(PatchTemplate)));
  const SetUp& set_up = checkpoint.set_up;
  body.add(set_up.camera).add(set_up.hand_eye).add(set_up.times).add(set_up.patient_frame).add(set_up.estimator);
  body.add(checkpoint.boot).add(checkpoint.saved).add(checkpoint.utc_ns);
  body.add(std::int64_t{checkpoint.suspended.count()});
  const MapMemory& memory = checkpoint.memory;
  body.add(memory.last_capture).add(std::int64_t{memory.frame_period.count()});
  body.add(static_cast<std::uint32_t>(memory.ecg.size()));
  for (const EcgBlock& block : memory.ecg) {
    body.add(block.first_sample_time).add(std::int64_t{block.sample_period.count()});
    body.add(static_cast<std::uint8_t>(block.lead_off)).add(block.count);
    for (const float mV : block.samples()) body.add(mV);
    body.add(static_cast<std::uint8_t>(block.has_second));
    if (!block.has_second) continue;
    body.add(static_cast<std::uint8_t>(block.second_off));
    for (const float mV : block.second_samples()) body.add(mV);
  }
  add_respiration(body, memory.respiration);
  add_law(body, memory.law);
  add_setup(body, memory.setup);
  // Each feature is as long as its state asks for.
  constexpr std::size_t kRest = 4 + 8 + 16 + 8 + sizeof(PatchTemplate) + 64 + 4 + 1 + 1 + 8;
  int state_size = 0;
  while (!features.empty() && state_size < kMaxState &&
         kRest + 8 * static_cast<std::size_t>(state_size + state_size * (state_size + 1) / 2) < features[0].size()) {
    ++state_size;
  }
  body.add(std::int32_t{state_size}).add(static_cast<std::uint32_t>(features.size()));
  for (const std::string& feature : features) body.raw(feature.data(), feature.size());
  const std::string bytes = body.take();
  Bytes file;
  file.raw(kMagic.data(), kMagic.size()).add(kFormat);
  file.add(crc32_update(0, std::as_bytes(std::span(bytes.data(), bytes.size())))).raw(bytes.data(), bytes.size());
  return file.take();
}

Expected<Checkpoint> parse_checkpoint(std::string_view bytes) {
  Reader in(bytes);
  std::string magic(kMagic.size(), '\0');
  in.raw(magic.data(), magic.size(), "a checkpoint");
  in.expect(magic == kMagic, "a checkpoint");
  const auto format = in.number<std::uint32_t>("the format");
  in.expect(format == kFormat, fmt::format("format {}; it is of format {}", kFormat, format));
  const auto crc = in.number<std::uint32_t>("a CRC");
  if (!in.good()) return in.error();
  const std::string_view body = bytes.substr(kHeader);
  in.expect(crc32_update(0, std::as_bytes(std::span(body.data(), body.size()))) == crc,
            "bytes that agree with the CRC");
  if (!in.good()) return in.error();
  return parse_checkpoint_body(body);
}

Expected<Checkpoint> parse_checkpoint_body(std::string_view body) {
  Reader in(body);
  Checkpoint checkpoint;
  const std::string version = in.text("the version");
  in.expect(version == PERIMAP_VERSION, "a checkpoint of this version, " PERIMAP_VERSION);
  const auto template_size = in.number<std::uint32_t>("the size of a template");
  in.expect(template_size == sizeof(PatchTemplate), "a checkpoint of this build");
  checkpoint.set_up.camera = in.text("the camera");
  checkpoint.set_up.hand_eye = in.text("the hand-eye transform");
  checkpoint.set_up.times = in.text("the time offsets");
  checkpoint.set_up.patient_frame = in.text("the patient's frame");
  checkpoint.set_up.estimator = in.text("the estimator");
  checkpoint.boot = in.text("the boot");
  checkpoint.saved = in.instant("when it was saved");
  checkpoint.utc_ns = in.number<std::int64_t>("when it was saved");
  in.expect(checkpoint.utc_ns >= 0 && checkpoint.utc_ns <= std::int64_t{1} << 62, "when it was saved");
  checkpoint.suspended = Duration(in.number<std::int64_t>("how long the machine had slept"));
  constexpr Duration kLongestSleep = std::chrono::hours(24 * 365 * 10);
  in.expect(checkpoint.suspended >= -kLongestSleep && checkpoint.suspended <= kLongestSleep,
            "how long the machine had slept");
  MapMemory& memory = checkpoint.memory;
  memory.last_capture = in.instant("the last capture");
  memory.frame_period = Duration(in.number<std::int64_t>("the frame period"));
  in.expect(memory.frame_period >= Duration(0) && memory.frame_period <= std::chrono::seconds(10), "a frame period");
  const std::uint32_t blocks = in.count(kMostBlocks, 21, "the number of ECG blocks");
  for (std::uint32_t i = 0; i < blocks && in.good(); ++i) memory.ecg.push_back(read_block(in));
  memory.respiration = read_respiration(in);
  in.expect(memory.respiration.clock.time <= checkpoint.saved, "a breath's phase of before it was saved");
  memory.law = read_law(in);
  memory.setup = read_setup(in);
  const auto state_size = in.number<std::int32_t>("the size of a state");
  in.expect(state_size >= 0 && state_size <= kMaxState, "the size of a state");
  const std::uint32_t features = in.count(kMostFeatures, sizeof(PatchTemplate), "the number of features");
  for (std::uint32_t i = 0; i < features && in.good(); ++i) {
    const FeatureMemory& feature = memory.features.emplace_back(read_feature(in, state_size));
    in.expect(memory.respiration.found || !feature.breathing, "no breathing in a feature, as it was not found");
  }
  in.expect(in.left() == 0, "the end");
  if (!in.good()) return in.error();
  return checkpoint;
}

// Not a WholeFile, which leaves a name that is taken to whoever took it: this is written again every few seconds, and
// what a killed process leaves beside it, a patient's, is to be overwritten by the next one or found by remove_file().
Expected<void> replace_file(const std::filesystem::path& file, std::string_view bytes) {
  const std::filesystem::path part = part_of(file);
  const auto failed = [&part](std::string_view what) {
    return fail(fmt::format("{}: cannot {}: {}", part.string(), what, system_message()));
  };
  {
    const Descriptor out(open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, S_IRUSR | S_IWUSR));
    if (!out) return failed("be created");
    while (!bytes.empty()) {
      const ssize_t written = write(out.get(), bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return failed("be written");
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    // On the disk before its name is: else a power cut could leave an empty file of that name.
    if (fsync(out.get()) != 0) return failed("be written");
  }
  if (rename(part.c_str(), file.c_str()) != 0) return failed("take its place");
  synchronise_folder(file);
  return {};
}

Expected<void> remove_file(const std::filesystem::path& file) {
  Expected<void> removed;
  for (const std::filesystem::path& path : {file, part_of(file)}) {
    if (unlink(path.c_str()) != 0 && errno != ENOENT) {
      removed = fail(fmt::format("{}: cannot be removed: {}", path.string(), system_message()));
    }
  }
  synchronise_folder(file);
  return removed;
}

}  // namespace perimap
