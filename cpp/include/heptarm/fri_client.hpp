// For applications written for KUKA's FRI client SDK: classes of that shape, of our own writing, over the native loop.
//
// Include this instead of friLBRClient.h, friUdpConnection.h and friClientApplication.h, and compile; any application on the
// cabinet may open the session. `step` answers one message: `command` is called before the answer that has its command, `monitor`
// and `waitForCommand` after an answer that mirrors the interpolator, `onStateChange` before either. The guard limits a command that
// leaves the robot's limits, such as a sine that begins with a jump of the velocity, where the cabinet would end the session.
#pragma once

#include <cstdio>
#include <cstring>
#include <memory>

#include "fri_loop.hpp"

namespace KUKA {
namespace FRI {

enum ESessionState { IDLE, MONITORING_WAIT, MONITORING_READY, COMMANDING_WAIT, COMMANDING_ACTIVE };
enum EConnectionQuality { POOR, FAIR, GOOD, EXCELLENT };
enum ESafetyState { NORMAL_OPERATION, SAFETY_STOP_LEVEL_0, SAFETY_STOP_LEVEL_1, SAFETY_STOP_LEVEL_2 };
enum EOperationMode { TEST_MODE_1, TEST_MODE_2, AUTOMATIC_MODE };
enum EDriveState { OFF, TRANSITIONING, ACTIVE };
enum EOverlayType { NO_OVERLAY, JOINT, CARTESIAN };
enum EControlMode { POSITION_CONTROL_MODE, CART_IMP_CONTROL_MODE, JOINT_IMP_CONTROL_MODE, NO_CONTROL };
enum EClientCommandMode { NO_COMMAND_MODE, POSITION, WRENCH, TORQUE, CARTESIAN_POSE };
constexpr EClientCommandMode JOINT_POSITION = POSITION;

/// What the newest message reports.
class LBRState {
public:
    enum { NUMBER_OF_JOINTS = 7 };

    double getSampleTime() const { return state_.period; }
    ESessionState getSessionState() const { return ESessionState(int(state_.session)); }
    EConnectionQuality getConnectionQuality() const { return EConnectionQuality(state_.quality); }
    ESafetyState getSafetyState() const { return ESafetyState(state_.safety < 0 ? 0 : state_.safety); }
    EOperationMode getOperationMode() const { return EOperationMode(state_.operation_mode < 0 ? 0 : state_.operation_mode); }
    EDriveState getDriveState() const { return EDriveState(state_.drive < 0 ? 0 : state_.drive); }
    EOverlayType getOverlayType() const { return EOverlayType(state_.overlay < 0 ? 0 : state_.overlay); }
    EControlMode getControlMode() const { return EControlMode(state_.control_mode < 0 ? 3 : state_.control_mode); }
    EClientCommandMode getClientCommandMode() const { return EClientCommandMode(state_.mode); }
    unsigned int getTimestampSec() const { return static_cast<unsigned int>(state_.stamp / 1000000000LL); }
    unsigned int getTimestampNanoSec() const { return static_cast<unsigned int>(state_.stamp % 1000000000LL); }
    const double* getMeasuredJointPosition() const { return state_.q.data(); }
    const double* getCommandedJointPosition() const { return state_.q_cmd.data(); }
    const double* getMeasuredTorque() const { return state_.tau.data(); }
    const double* getCommandedTorque() const { return state_.tau_cmd.data(); }
    const double* getExternalTorque() const { return state_.tau_ext.data(); }
    const double* getIpoJointPosition() const { return state_.q_ipo.data(); }
    double getTrackingPerformance() const { return state_.tracking; }

    /// Poses x y z [mm], quaternion w x y z.
    const double* getMeasuredCartesianPose() const { return wire(state_.pose, 0); }
    const double* getIpoCartesianPose() const { return wire(state_.pose_ipo, 1); }
    double getMeasuredRedundancyValue() const { return state_.e1; }
    double getIpoRedundancyValue() const { return state_.e1_ipo; }

    /// Signals of the session by name; a name that it does not have throws std::invalid_argument.
    bool getBooleanIOValue(const char* name) const { return value(name) != 0; }
    unsigned long long getDigitalIOValue(const char* name) const { return static_cast<unsigned long long>(value(name)); }
    double getAnalogIOValue(const char* name) const { return value(name); }

private:
    friend class ClientApplication;

    const double* wire(const std::array<double, 7>& pose, int place) const {
        poses_[place] = {1e3 * pose[0], 1e3 * pose[1], 1e3 * pose[2], pose[6], pose[3], pose[4], pose[5]};
        return poses_[place].data();
    }

    double value(const std::string& name) const {
        for (const heptarm::FriSignal& signal : signals_)
            if (signal.name == name || signal.name.substr(signal.name.rfind('.') + 1) == name) return signal.value;
        throw std::invalid_argument("the session carries no signal " + name);
    }

    heptarm::FriState state_;
    std::vector<heptarm::FriSignal> signals_;
    mutable std::array<double, 7> poses_[2]{};
};

/// What the answer to the newest message commands.
class LBRCommand {
public:
    void setJointPosition(const double* values) { std::memcpy(command_.q.data(), values, sizeof command_.q); }
    void setTorque(const double* values) { std::memcpy(command_.tau.data(), values, sizeof command_.tau); }
    void setWrench(const double* values) { std::memcpy(command_.wrench.data(), values, sizeof command_.wrench); }
    /// A pose x y z [mm], quaternion w x y z, and its redundancy angle [rad]; without one it is the interpolator's.
    void setCartesianPose(const double* pose, const double* redundancy = nullptr) {
        command_.pose = {1e-3 * pose[0], 1e-3 * pose[1], 1e-3 * pose[2], pose[4], pose[5], pose[6], pose[3]};
        if (redundancy != nullptr) command_.e1 = *redundancy;
    }
    void setBooleanIOValue(const char* name, bool value) { outputs_[name] = value ? 1 : 0; }
    void setDigitalIOValue(const char* name, unsigned long long value) { outputs_[name] = static_cast<double>(value); }
    void setAnalogIOValue(const char* name, double value) { outputs_[name] = value; }

private:
    std::map<std::string, double> outputs_;
    friend class LBRClient;
    friend class ClientApplication;
    heptarm::FriCommand command_;
};

/// Derive from it, and override what you need.
class LBRClient {
public:
    virtual ~LBRClient() = default;
    virtual void onStateChange(ESessionState oldState, ESessionState newState) {
        (void)oldState;
        (void)newState;
    }
    /// Called while the session only monitors.
    virtual void monitor() {}
    /// Called before commands are effective; the interpolator is commanded whatever this sets.
    virtual void waitForCommand() {}
    /// Called while commands are effective; without an override the interpolator is commanded.
    virtual void command() { robotCommand().setJointPosition(robotState().getIpoJointPosition()); }

    const LBRState& robotState() const { return state_; }
    LBRCommand& robotCommand() { return command_; }

private:
    friend class ClientApplication;
    LBRState state_;
    LBRCommand command_;
};

/// The port of an application; `ClientApplication` opens it.
class UdpConnection {
public:
    explicit UdpConnection(unsigned int receiveTimeout = 0) : timeout_(receiveTimeout) {}

private:
    friend class ClientApplication;
    unsigned int timeout_;  // [ms]; 0: waits for ever
};

/// Answers the messages of a session.
class ClientApplication {
public:
    ClientApplication(UdpConnection& connection, LBRClient& client, const heptarm::FriLoopOptions& options = {})
        : connection_(connection), client_(client), options_(options) {}

    /// Opens a port; `remoteHost` is the only one that may send, if it is given. False: it cannot.
    bool connect(int port, const char* remoteHost = nullptr) {
        disconnect();
        options_.port = static_cast<std::uint16_t>(port);
        options_.remote = remoteHost == nullptr ? "" : remoteHost;
        try {
            loop_ = std::make_unique<heptarm::FriLoop>(
                options_, [this](const heptarm::FriState& now, heptarm::FriCommand& command) { answer(now, command); });
        } catch (const std::exception& error) {
            std::fprintf(stderr, "%s\n", error.what());
            return false;
        }
        return true;
    }

    /// Closes the port. If commands are effective, the arm comes to rest first.
    void disconnect() {
        if (!loop_) return;
        loop_->stop();
        while (loop_->step()) {
        }
        loop_.reset();
    }

    /// Waits for a message and answers it. False: none came within the timeout of the connection, or the session has ended.
    bool step() {
        if (!loop_) return false;
        const std::int64_t before = loop_->messages();
        for (unsigned int waited = 0; loop_->messages() == before; waited += PATIENCE) {
            if (connection_.timeout_ != 0 && waited > connection_.timeout_) return false;
            if (!loop_->step()) return false;
        }
        const heptarm::FriState now = loop_->state();
        if (now.number != answered_) observe(now);  // `command` has not seen it
        return now.session != heptarm::FriSessionState::idle;
    }

    /// The port's counts, and what the guard has limited.
    std::string report() const { return loop_ ? loop_->report() : "not connected"; }
    std::uint16_t port() const { return loop_ ? loop_->port() : 0; }

private:
    static constexpr unsigned int PATIENCE = 50;  // of one step of the loop [ms]

    void take(const heptarm::FriState& now) {
        const ESessionState before = client_.state_.getSessionState();
        client_.state_.state_ = now;
        client_.state_.signals_ = loop_->signals();
        if (client_.state_.getSessionState() != before) client_.onStateChange(before, client_.state_.getSessionState());
    }

    void answer(const heptarm::FriState& now, heptarm::FriCommand& command) {
        answered_ = now.number;
        take(now);
        client_.command_.command_ = command;
        client_.command();
        command = client_.command_.command_;
        write();
    }

    /// Writes the outputs that were set; a name without its group is completed.
    void write() {
        for (const auto& [name, value] : client_.command_.outputs_) {
            std::string full = name;
            for (const heptarm::FriSignal& signal : client_.state_.signals_)
                if (signal.is_output && signal.name.substr(signal.name.rfind('.') + 1) == name) full = signal.name;
            loop_->write(full, value);
        }
        client_.command_.outputs_.clear();
    }

    void observe(const heptarm::FriState& now) {
        take(now);
        if (now.session == heptarm::FriSessionState::commanding_wait)
            client_.waitForCommand();
        else if (now.session < heptarm::FriSessionState::commanding_wait)
            client_.monitor();
        write();
    }

    UdpConnection& connection_;
    LBRClient& client_;
    heptarm::FriLoopOptions options_;
    std::unique_ptr<heptarm::FriLoop> loop_;
    std::int64_t answered_ = -1;
};

}  // namespace FRI
}  // namespace KUKA
