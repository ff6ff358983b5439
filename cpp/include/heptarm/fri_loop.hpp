// FRI in C++17 over the native loop: a UDP port, the messages of every FRI version, and the guard. No SDK of KUKA.
//
// The loop is C (native/fri_*.c); cpp/CMakeLists.txt and the guide have the commands that compile it. A program that has an `Arm` uses fri.hpp; one
// whose FRI session some other application opens uses this file, or fri_client.hpp, which has the shape of KUKA's classes.
#pragma once

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <limits>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "heptarm_law.h"
#include "models.hpp"

namespace heptarm {
namespace native {
extern "C" {
#include "fri_layout.h"
struct fri_loop;
fri_loop* fri_new(fri_seam* seam);
void fri_free(fri_loop* loop);
int fri_step(fri_loop* loop, int is_called);
}
}  // namespace native

/// State of an FRI session.
enum class FriSessionState { idle, monitoring_wait, monitoring_ready, commanding_wait, commanding_active };

/// A message of the controller and its answer; numbers that this version of FRI does not send are NaN.
struct FriState {
    using Joints = std::array<double, 7>;
    FriSessionState session = FriSessionState::idle;
    int quality = 0;            ///< 0 poor to 3 excellent
    int mode = 0;               ///< what may be commanded: 1 position, 2 wrench, 3 torque, 4 pose
    int safety = -1;            ///< 0 normal, 1 to 3 stops
    int operation_mode = -1;    ///< 0 T1, 1 T2, 2 AUT
    int drive = -1, overlay = -1, control_mode = -1;
    double period = 0;          ///< from message to message [s]
    double tracking = 0;        ///< tracking performance, 0 to 1
    std::int64_t stamp = 0;     ///< the controller's clock [ns]
    std::int64_t number = -1;   ///< counts the messages of this loop, from 0; -1: none came yet
    bool limited = false;       ///< the guard changed the command
    Joints q{}, tau{}, q_cmd{}, tau_cmd{}, tau_ext{}, q_ipo{};  ///< [rad], [Nm]
    Joints q_sent{}, tau_sent{};                                ///< in the answer
    std::array<double, 6> wrench{};                             ///< external, on the flange; estimated before FRI 2.7 [N, Nm]
    std::array<double, 7> pose{}, pose_ipo{}, pose_sent{};      ///< x y z [m], quaternion x y z w; FRI 2.x, the others in pose sessions
    double e1 = 0, e1_ipo = 0, e1_sent = 0;                     ///< redundancy angle [rad]

    bool is_commanding() const { return session == FriSessionState::commanding_active; }
};

/// What a client commands; only what the session commands is sent.
struct FriCommand {
    std::array<double, 7> q{}, tau{};  ///< [rad], superposed [Nm]
    std::array<double, 6> wrench{};    ///< superposed [N, Nm]
    std::array<double, 7> pose{};      ///< x y z [m], quaternion x y z w; initially the interpolator's
    double e1 = 0;                     ///< redundancy angle of the pose [rad]; initially the interpolator's
};

/// A signal of the session: an input or output of the cabinet.
struct FriSignal {
    enum class Kind { boolean, digital, analog };
    std::string name;  ///< with its group, as the cabinet sends it
    Kind kind = Kind::boolean;
    bool is_output = false;
    double value = 0;  ///< in the newest message; 0 or 1 of a boolean one
};

/// What the guard lets through.
struct FriGuard {
    double fraction = 0.95;                                     ///< of the largest velocity, acceleration, jerk and torque, (0, 1]
    double margin = 0.0174533;                                  ///< distance from the position limits [rad]
    double reach = std::numeric_limits<double>::infinity();     ///< distance of a position from the interpolator [rad]
    double force = 150.0, torque = 50.0;                        ///< largest superposed wrench [N], [Nm]
};

struct FriLoopOptions {
    std::string model = "iiwa14";  ///< whose limits the guard has
    std::string host = "0.0.0.0";  ///< own address to bind
    std::uint16_t port = 0;        ///< UDP; 0: any free one
    std::string remote;            ///< address of the controller; empty: whoever sends first
    FriGuard guard;
};

/// A port that answers the controller. One thread calls `step`; `state` and `command` may be called from another one.
class FriLoop {
public:
    /// What is called in each message while commands are effective, with the state; it fills the command.
    using Law = std::function<void(const FriState&, FriCommand&)>;

    explicit FriLoop(const FriLoopOptions& options, Law law = nullptr) : law_(std::move(law)) {
        const RobotModel& model = robot_model(options.model);
        const FriGuard& guard = options.guard;
        if (!(guard.fraction > 0 && guard.fraction <= 1))
            throw std::invalid_argument("fraction must be in (0, 1], got " + std::to_string(guard.fraction));
        open(options);
        lay_out();
        limit(model, guard);
        seam_.has_law = law_ != nullptr;
        if (!options.remote.empty()) seam_.remote = address(options.remote);
        loop_ = native::fri_new(&seam_);
        if (loop_ == nullptr) throw std::bad_alloc();
    }

    FriLoop(const FriLoop&) = delete;
    FriLoop& operator=(const FriLoop&) = delete;

    ~FriLoop() {
        native::fri_free(loop_);
        ::close(static_cast<int>(seam_.sock));
    }

    std::uint16_t port() const { return port_; }

    /// Answers the next message, or waits for it up to 50 ms. False: the loop was stopped, and the arm commanded to rest.
    /// Throws std::runtime_error if the port fails; what the law throws ends all commands first: the arm brakes.
    bool step() {
        int code = native::fri_step(loop_, 0);
        if (code == native::CALL_LAW) {
            try {
                call_law();
            } catch (...) {
                stop();
                native::fri_step(loop_, 1);
                throw;
            }
            code = native::fri_step(loop_, 1);
        }
        if (code == native::SOCKET_ERROR)
            throw std::runtime_error("UDP port " + std::to_string(port_) + " fails: " + std::strerror(int(seam_.error)));
        return code != native::ENDED;
    }

    /// Ends all commands: the arm brakes within the guard's limits; then `step` returns false.
    void stop() { __atomic_store_n(&header()[native::H_STOP], 1, __ATOMIC_RELEASE); }

    /// Lets the guard unwind the spring that torques or a wrench have wound, before a session ends.
    void release() { __atomic_store_n(&header()[native::H_RELEASE], 1, __ATOMIC_RELEASE); }

    /// Number of messages so far.
    std::int64_t messages() const { return __atomic_load_n(&header()[native::H_STATES], __ATOMIC_ACQUIRE); }

    /// The newest message; its number is -1 before the first one.
    FriState state() const {
        FriState found;
        for (std::int64_t tick = messages() - 1; tick >= 0; tick = messages() - 1)
            if (read(tick, found)) break;
        return found;
    }

    /// Commands what is not empty until the next call; for the session whose state is the newest. The guard limits it; without a
    /// new command for 50 ms the arm brakes.
    void command(const std::array<double, 7>* q, const std::array<double, 7>* tau = nullptr,
                 const std::array<double, 6>* wrench = nullptr) {
        const word tick = header()[native::H_COMMANDS];
        word* const slot = begin(
            tick, (q ? native::GIVEN_Q : 0) | (tau ? native::GIVEN_TAU : 0) | (wrench ? native::GIVEN_WRENCH : 0));
        if (q) std::memcpy(slot + native::C_Q, q->data(), sizeof *q);
        if (tau) std::memcpy(slot + native::C_TAU, tau->data(), sizeof *tau);
        if (wrench) std::memcpy(slot + native::C_WRENCH, wrench->data(), sizeof *wrench);
        finish(slot, tick);
    }

    /// Commands a pose x y z [m] and quaternion x y z w, and a redundancy angle [rad] unless it is NaN; see `command`.
    void command_pose(const std::array<double, 7>& pose, double e1 = std::numeric_limits<double>::quiet_NaN()) {
        const word tick = header()[native::H_COMMANDS];
        word* const slot = begin(tick, native::GIVEN_POSE | (std::isnan(e1) ? 0 : native::GIVEN_E1));
        std::memcpy(slot + native::C_POSE, pose.data(), sizeof pose);
        std::memcpy(slot + native::C_E1, &e1, sizeof e1);
        finish(slot, tick);
    }

    /// The session's signals with their values in the newest message; empty before the first one.
    std::vector<FriSignal> signals() const {
        std::vector<FriSignal> found;
        const word* const note = offered_.data();
        for (;;) {
            const word tick = __atomic_load_n(note, __ATOMIC_ACQUIRE);
            found.clear();
            if (tick == 0) return found;
            if (tick & 1) continue;
            const word* at = note + 3;
            for (word i = 0; i < note[1] && i < native::MAX_IO; ++i, at += 2 + native::NAME_WORDS) {
                const std::size_t size = std::size_t(std::min<word>(at[2], native::NAME_BYTES));
                found.push_back({std::string(reinterpret_cast<const char*>(at + 3), size), FriSignal::Kind(at[0]),
                                 at[1] == native::OUTPUT, 0});
            }
            __atomic_thread_fence(__ATOMIC_ACQUIRE);
            if (__atomic_load_n(note, __ATOMIC_RELAXED) == tick) break;
        }
        const word newest = messages() - 1;
        for (std::size_t i = 0; newest >= 0 && i < found.size(); ++i)
            std::memcpy(&found[i].value, states_.data() + newest % HISTORY * native::STATE_WORDS + native::S_IO + i, sizeof(double));
        return found;
    }

    /// Writes an output until the cabinet shows it. Throws std::invalid_argument if the session has no output of that name.
    void write(const std::string& name, double value) {
        std::string known;
        for (const FriSignal& signal : signals()) {
            if (signal.name == name && signal.is_output) {
                if (signal.kind != FriSignal::Kind::analog && !(value >= 0 && value == std::floor(value)))
                    throw std::invalid_argument(name + " must be a whole number from 0 on, got " + text(value));
                written_[name] = {++writes_, signal.kind == FriSignal::Kind::analog, value};
                publish();
                return;
            }
            if (signal.is_output) known += (known.empty() ? "" : ", ") + signal.name;
        }
        throw std::invalid_argument("no output of the session has the name " + name + "; it has " + (known.empty() ? "none" : known));
    }

    /// What the guard has limited so far, a line each.
    std::vector<std::string> limited() const {
        static const char* const kinds[] = {"not finite", "position", "velocity", "acceleration", "jerk", "torque", "wrench"};
        std::vector<std::string> lines;
        for (int kind = 0; kind < 7; ++kind)
            for (int axis = 0; axis < 7; ++axis) {
                const int place = 7 * kind + axis;
                const word count = header()[native::H_LIMITED_COUNTS + place];
                if (count == 0) continue;
                const std::string where = kind == 6 ? "component " + std::to_string(axis + 1) : "A" + std::to_string(axis + 1);
                lines.push_back(std::string(kinds[kind]) + " of " + where + " in " + std::to_string(count) +
                                " cycles: asked " + text(real(native::H_LIMITED_WORST + place)) + ", allowed " +
                                text(real(native::H_LIMITED_ALLOWED + place)));
            }
        return lines;
    }

    /// Messages, losses and limits, in words.
    std::string report() const {
        const auto count = [this](int which) { return std::to_string(header()[native::H_COUNTS + which]); };
        std::string all = count(native::COUNT_RECEIVED) + " messages, " + count(native::COUNT_ANSWERED) + " answered, " +
                          count(native::COUNT_LOST) + " lost, " + count(native::COUNT_MALFORMED) + " malformed, " +
                          count(native::COUNT_LIMITED) + " commands limited";
        for (const std::string& line : limited()) all += "\n" + line;
        const word* const note = trouble_.data();
        if (header()[native::H_STATES] == 0 && note[1] > 0)
            all += "\n" + std::string(reinterpret_cast<const char*>(note + 2), std::size_t(std::min<word>(note[1], 400)));
        return all;
    }

private:
    using word = native::word;
    static constexpr int HISTORY = 64;

    struct Written {
        word count = 0;
        bool is_analog = false;
        double value = 0;
    };

    word* begin(word tick, int given) {
        word* const slot = commands_.data() + tick % native::COMMAND_SLOTS * native::COMMAND_WORDS;
        __atomic_store_n(slot, 2 * tick + 1, __ATOMIC_RELAXED);
        __atomic_thread_fence(__ATOMIC_RELEASE);
        slot[native::C_AT] = monotonic();
        slot[native::C_GIVEN] = given;
        slot[native::C_EPOCH] = __atomic_load_n(&header()[native::H_EPOCH], __ATOMIC_ACQUIRE);
        return slot;
    }

    void finish(word* slot, word tick) {
        __atomic_store_n(slot, 2 * tick + 2, __ATOMIC_RELEASE);
        __atomic_store_n(&header()[native::H_COMMANDS], tick + 1, __ATOMIC_RELEASE);
    }

    /// Hands all written outputs to the loop.
    void publish() {
        word* const note = outputs_.data();
        __atomic_store_n(note, note[0] | 1, __ATOMIC_RELAXED);
        __atomic_thread_fence(__ATOMIC_RELEASE);
        word* at = note + 3;
        for (const auto& [name, output] : written_) {
            const word number = static_cast<word>(output.value);
            at[0] = output.count;
            at[1] = output.is_analog;
            if (output.is_analog)
                std::memcpy(at + 2, &output.value, sizeof output.value);
            else
                at[2] = number;
            std::memset(at + 3, 0, native::NAME_WORDS * sizeof(word));
            at[3] = static_cast<word>(name.size());
            std::memcpy(at + 4, name.data(), name.size());
            at += 3 + native::NAME_WORDS;
        }
        note[1] = static_cast<word>(written_.size());
        note[2] = 0;
        __atomic_store_n(note, note[0] + 1, __ATOMIC_RELEASE);
    }

    void open(const FriLoopOptions& options) {
        const int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        sockaddr_in own{};
        own.sin_family = AF_INET;
        own.sin_port = htons(options.port);
        own.sin_addr.s_addr = address(options.host);
        const timeval patience{0, 50000};
        const int one = 1;
        ::setsockopt(file, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
#ifdef SO_TIMESTAMPNS
        ::setsockopt(file, SOL_SOCKET, SO_TIMESTAMPNS, &one, sizeof one);
#endif
        socklen_t size = sizeof own;
        if (::bind(file, reinterpret_cast<sockaddr*>(&own), size) != 0) {
            const std::string why = std::strerror(errno);
            ::close(file);
            throw std::runtime_error("UDP port " + std::to_string(options.port) + " of " + options.host + " cannot be used: " + why);
        }
        ::getsockname(file, reinterpret_cast<sockaddr*>(&own), &size);
        port_ = ntohs(own.sin_port);
        seam_.sock = file;
    }

    static std::uint32_t address(const std::string& host) {
        in_addr found{};
        if (::inet_pton(AF_INET, host.c_str(), &found) != 1)
            throw std::invalid_argument("an address must be four numbers, got " + host);
        return found.s_addr;
    }

    void lay_out() {
        header_.resize(native::H_COLLISION_ALLOWED + 8);
        states_.resize(HISTORY * native::STATE_WORDS);
        commands_.resize(native::COMMAND_SLOTS * native::COMMAND_WORDS);
        events_.resize(native::EVENT_SLOTS * native::EVENT_WORDS);
        for (std::vector<word>* note : {&trouble_, &offered_, &outputs_}) note->resize(native::NOTE_WORDS);
        seam_.header = header_.data();
        seam_.states = states_.data();
        seam_.commands = commands_.data();
        seam_.events = events_.data();
        seam_.trouble = trouble_.data();
        seam_.offered = offered_.data();
        seam_.outputs = outputs_.data();
        seam_.history = HISTORY;
        seam_.version = native::ABSENT;  // that of the first message
        seam_.missing = native::RAMP_DOWN;
        seam_.patience = 0.05;
        seam_.over = 0.1;
    }

    void limit(const RobotModel& model, const FriGuard& guard) {
        native::joint_limits& limits = seam_.joint_limits;
        for (int i = 0; i < 7; ++i) {
            limits.q_min[i] = model.q_min[i] + guard.margin;
            limits.q_max[i] = model.q_max[i] - guard.margin;
            limits.dq_max[i] = guard.fraction * model.dq_max[i];
            limits.ddq_max[i] = guard.fraction * model.ddq_max[i];
            limits.dddq_max[i] = guard.fraction * model.dddq_max[i];
            limits.tau_max[i] = guard.fraction * model.tau_max[i];
            limits.dtau_max[i] = 20 * limits.tau_max[i];
            seam_.lowest[i] = model.q_min[i];
            seam_.highest[i] = model.q_max[i];
            seam_.fastest[i] = model.dq_max[i];
        }
        for (int i = 0; i < 6; ++i) {
            limits.wrench_max[i] = i < 3 ? guard.force : guard.torque;
            limits.dwrench_max[i] = 20 * limits.wrench_max[i];
        }
        limits.reach = guard.reach;
        seam_.pose_limits = {0.25, 1.0, 1.0, 4.0, 0.5, 2.0, std::numeric_limits<double>::infinity()};
        seam_.has_chain = 1;
        std::memcpy(seam_.chain, model.chain, sizeof model.chain);
        // `struct torque_guard`: the robot, its limits, then its state
        double* at = reinterpret_cast<double*>(torques_.data());
        for (const auto& [from, size] : {std::pair{model.bodies, 105}, {limits.q_min, 7}, {limits.q_max, 7}, {limits.dq_max, 7},
                                         {limits.ddq_max, 7}, {limits.tau_max, 7}}) {
            std::memcpy(at, from, std::size_t(size) * sizeof(double));
            at += size;
        }
        seam_.torque_guard = torques_.data();
    }

    bool read(std::int64_t tick, FriState& into) const {
        const word* const slot = states_.data() + tick % HISTORY * native::STATE_WORDS;
        if (__atomic_load_n(slot, __ATOMIC_ACQUIRE) != 2 * tick + 2) return false;
        FriState found = unpacked(slot);
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (__atomic_load_n(slot, __ATOMIC_RELAXED) != 2 * tick + 2) return false;
        found.number = tick;
        into = found;
        return true;
    }

    static FriState unpacked(const word* slot) {
        const auto copy = [slot](auto& into, int at) { std::memcpy(into.data(), slot + at, sizeof into); };
        FriState found;
        found.session = FriSessionState(slot[native::S_SESSION]);
        found.quality = int(slot[native::S_QUALITY]);
        found.mode = int(slot[native::S_MODE]);
        found.safety = int(slot[native::S_SAFETY]);
        found.operation_mode = int(slot[native::S_OPERATION]);
        found.drive = int(slot[native::S_DRIVE]);
        found.overlay = int(slot[native::S_OVERLAY]);
        found.control_mode = int(slot[native::S_CONTROL]);
        found.period = 1e-9 * double(slot[native::S_PERIOD]);
        found.stamp = slot[native::S_STAMP];
        found.limited = (slot[native::S_FLAGS] & native::LIMITED) != 0;
        std::memcpy(&found.tracking, slot + native::S_TRACKING, sizeof found.tracking);
        copy(found.q, native::S_Q);
        copy(found.tau, native::S_TAU);
        copy(found.q_cmd, native::S_Q_CMD);
        copy(found.tau_cmd, native::S_TAU_CMD);
        copy(found.tau_ext, native::S_TAU_EXT);
        copy(found.q_ipo, native::S_Q_IPO);
        copy(found.q_sent, native::S_Q_SENT);
        copy(found.tau_sent, native::S_TAU_SENT);
        copy(found.wrench, native::S_WRENCH);
        const auto pose = [slot](std::array<double, 7>& into, int at) {  // mm and w x y z before
            std::array<double, 7> wire;
            std::memcpy(wire.data(), slot + at, sizeof wire);
            into = {1e-3 * wire[0], 1e-3 * wire[1], 1e-3 * wire[2], wire[4], wire[5], wire[6], wire[3]};
        };
        pose(found.pose, native::S_POSE);
        pose(found.pose_ipo, native::S_POSE_IPO);
        pose(found.pose_sent, native::S_POSE_SENT);
        std::memcpy(&found.e1, slot + native::S_E1, sizeof found.e1);
        std::memcpy(&found.e1_ipo, slot + native::S_E1_IPO, sizeof found.e1_ipo);
        std::memcpy(&found.e1_sent, slot + native::S_E1_SENT, sizeof found.e1_sent);
        return found;
    }

    void call_law() {
        const std::int64_t tick = header()[native::H_STATES];
        FriState now = unpacked(states_.data() + tick % HISTORY * native::STATE_WORDS);
        now.number = tick;
        FriCommand command;
        std::memcpy(command.q.data(), seam_.out.q, sizeof command.q);
        std::memcpy(command.pose.data(), seam_.out.pose, sizeof command.pose);
        command.e1 = seam_.out.e1;
        law_(now, command);
        std::memcpy(seam_.out.q, command.q.data(), sizeof command.q);
        std::memcpy(seam_.out.tau, command.tau.data(), sizeof command.tau);
        std::memcpy(seam_.out.wrench, command.wrench.data(), sizeof command.wrench);
        std::memcpy(seam_.out.pose, command.pose.data(), sizeof command.pose);
        seam_.out.e1 = command.e1;
    }

    static std::int64_t monotonic() {
        timespec now{};
        ::clock_gettime(CLOCK_MONOTONIC, &now);
        return now.tv_sec * 1000000000LL + now.tv_nsec;
    }

    static std::string text(double value) {
        char buffer[32];
        std::snprintf(buffer, sizeof buffer, "%.4g", value);
        return buffer;
    }

    word* header() { return header_.data(); }
    const word* header() const { return header_.data(); }
    double real(int at) const {
        double value;
        std::memcpy(&value, header() + at, sizeof value);
        return value;
    }

    Law law_;
    native::fri_seam seam_{};
    native::fri_loop* loop_ = nullptr;
    std::uint16_t port_ = 0;
    std::vector<word> header_, states_, commands_, events_, trouble_, offered_, outputs_;
    std::map<std::string, Written> written_;
    word writes_ = 0;
    std::array<word, 256> torques_{};  // its state needs less
};

}  // namespace heptarm
