// A function for MATLAB and Octave over the C++ client: one arm, motions that wait, states.
//
//     mex -R2018a CXXFLAGS='$CXXFLAGS -std=c++17 -pthread' -I../../cpp/include heptarm_mex.cpp         % MATLAB: not tried
//     mkoctfile --mex -std=c++17 -pthread -I../../cpp/include heptarm_mex.cpp                          % Octave
//
//     heptarm_mex("connect", "172.31.1.147")        takes control; HEPTARM_KEY has the cabinet's key, if it has one
//     heptarm_mex("ptp", [0 0.52 0 -1.57 0 1.05 0], 0.5)           radians; a fraction of the full speed
//     heptarm_mex("lin_rel", [0 0 -0.1], "base", 0.2)              metres; metres per second
//     q = heptarm_mex("q"); p = heptarm_mex("pose")                1x7 [rad]; 1x7: x y z [m], quaternion x y z w
//     heptarm_mex("stop"); heptarm_mex("close")

#include <cstdlib>
#include <memory>
#include <string>

#include "heptarm/heptarm.hpp"
#include "mex.h"

namespace {

std::unique_ptr<heptarm::Arm> connected;

void close_arm() { connected.reset(); }

heptarm::Arm& arm() {
    if (!connected) throw heptarm::Error("there is no connection", 0, "call heptarm_mex(\"connect\", address) first");
    return *connected;
}

std::string text_of(const mxArray* value, const char* name) {
    char* text = value == nullptr || !mxIsChar(value) ? nullptr : mxArrayToString(value);
    if (text == nullptr) throw heptarm::Error(std::string(name) + " must be a text");
    const std::string copy(text);
    mxFree(text);
    return copy;
}

template <std::size_t Size>
std::array<double, Size> numbers_of(const mxArray* value, const char* name) {
    if (value == nullptr || !mxIsDouble(value) || mxIsComplex(value) || mxGetNumberOfElements(value) != Size)
        throw heptarm::Error(std::string(name) + " must be " + std::to_string(Size) + " real numbers");
    std::array<double, Size> copy;
    std::copy_n(mxGetPr(value), Size, copy.begin());
    return copy;
}

template <class Numbers>
mxArray* row(const Numbers& numbers) {
    mxArray* made = mxCreateDoubleMatrix(1, numbers.size(), mxREAL);
    std::copy(numbers.begin(), numbers.end(), mxGetPr(made));
    return made;
}

mxArray* execute(const std::string& command, const mxArray* const* given, int count) {
    const auto argument = [&](int number) { return number < count ? given[number] : nullptr; };
    if (command == "connect") {
        heptarm::Options options;
        options.name = "mex";
        options.watchdog = 2.0;
        if (const char* key = std::getenv("HEPTARM_KEY")) options.key = key;
        connected.reset();
        connected = std::make_unique<heptarm::Arm>(text_of(argument(0), "the address"), options);
        connected->take_control();
        return mxCreateString(connected->welcome().robot.title.c_str());
    }
    if (command == "ptp") {
        arm().move(heptarm::ptp(numbers_of<7>(argument(0), "q [rad]"), numbers_of<1>(argument(1), "the speed")[0]));
    } else if (command == "lin_rel") {
        arm().move(heptarm::lin_rel(numbers_of<3>(argument(0), "the offset [m]"), text_of(argument(1), "the frame"),
                                    numbers_of<1>(argument(2), "the speed [m/s]")[0]));
    } else if (command == "q") {
        return row(arm().state().joints->q);
    } else if (command == "pose") {
        const auto state = arm().state();
        std::array<double, 7> pose;
        std::copy(state.pose->xyz.begin(), state.pose->xyz.end(), pose.begin());
        std::copy(state.pose->quat.begin(), state.pose->quat.end(), pose.begin() + 3);
        return row(pose);
    } else if (command == "stop") {
        arm().stop();
    } else if (command == "close") {
        close_arm();
    } else {
        throw heptarm::Error("the command must be connect, ptp, lin_rel, q, pose, stop or close, got " + command);
    }
    return mxCreateDoubleMatrix(0, 0, mxREAL);
}

}  // namespace

void mexFunction(int results, mxArray* result[], int count, const mxArray* given[]) {
    static_cast<void>(results);
    static char failure[1024];  // MATLAB leaves this function without destructors when it reports an error
    failure[0] = '\0';
    mexAtExit(close_arm);
    try {
        result[0] = execute(text_of(count > 0 ? given[0] : nullptr, "the command"), given + 1, count - 1);
    } catch (const std::exception& error) {
        std::snprintf(failure, sizeof failure, "%s", error.what());
    }
    if (failure[0] != '\0') mexErrMsgIdAndTxt("heptarm:refused", "%s", failure);
}
