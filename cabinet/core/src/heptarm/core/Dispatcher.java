package heptarm.core;

import heptarm.wire.Accepted;
import heptarm.wire.Cancel;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.FriClose;
import heptarm.wire.FriOpen;
import heptarm.wire.Goodbye;
import heptarm.wire.HandGuide;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointPoint;
import heptarm.wire.JointSpline;
import heptarm.wire.LinRel;
import heptarm.wire.Message;
import heptarm.wire.Messages;
import heptarm.wire.Mode;
import heptarm.wire.PathReached;
import heptarm.wire.Pause;
import heptarm.wire.Ping;
import heptarm.wire.Pong;
import heptarm.wire.Ptp;
import heptarm.wire.Recover;
import heptarm.wire.Rejected;
import heptarm.wire.ReleaseControl;
import heptarm.wire.Resume;
import heptarm.wire.RobotInfo;
import heptarm.wire.Run;
import heptarm.wire.ServoClose;
import heptarm.wire.ServoJoints;
import heptarm.wire.ServoJointsVelocity;
import heptarm.wire.ServoOpen;
import heptarm.wire.ServoPose;
import heptarm.wire.ServoSettings;
import heptarm.wire.SetOverride;
import heptarm.wire.SineImpedance;
import heptarm.wire.Stop;
import heptarm.wire.Subscribe;
import heptarm.wire.TakeControl;
import heptarm.wire.Violation;
import heptarm.wire.WireException;

/** Turns the requests of an open session into actions, and every refusal into an answer that says why. */
final class Dispatcher {
    private final Server server;

    Dispatcher(Server server) {
        this.server = server;
    }

    /** Handles one frame; called by the client's reader. Nothing that a client sends gets past here as an exception. */
    void handle(Client client, int type, long request, long sent, byte[] data, int offset, int length) {
        try {
            Message message = Messages.read(type, data, offset, length);
            if (message == null || !Messages.fromClient(type)) {
                throw new Refusal(Code.UNKNOWN_MESSAGE, "message " + type + " is not known here");
            }
            if (message instanceof Ping) {
                client.answer(new Pong(((Ping) message).sent, client.heard()), 0);
                return;
            }
            if (message instanceof Pong) {
                return;
            }
            if (message instanceof Goodbye) {
                client.leave("it said goodbye");
                return;
            }
            if (Messages.needsControl(type) && !server.authority.holds(client)) {
                String holder = server.authority.name();
                throw new Refusal(Code.NOT_IN_CONTROL, "controller", holder, client.name(),
                        holder.length() == 0 ? "nobody controls the robot; take control first"
                                : holder + " controls the robot, not " + client.name());
            }
            if (type == ServoJoints.TYPE || type == ServoJointsVelocity.TYPE || type == ServoPose.TYPE) {
                steer(message, sent);
                return;
            }
            message.validate("");
            client.answer(act(client, message), request);
        } catch (WireException e) {
            refuse(client, request, new Refusal(Code.BAD_BODY, "message " + type + ": " + e.getMessage()));
        } catch (Violation e) {
            refuse(client, request, new Refusal(e.code, e.parameter, e.value, e.allowed, e.getMessage()));
        } catch (Refusal e) {
            refuse(client, request, e);
        } catch (RuntimeException e) {
            fail(client, type, request, e);
        } catch (LinkageError e) { // a class that this cabinet lacks
            fail(client, type, request, e);
        }
    }

    /** Carries out an order that comes from the cabinet itself; returns its number, 0 where it has none. */
    long order(Message message) throws Refusal {
        check(message);
        return ((Accepted) act(null, message)).id;
    }

    /** Hands over a servo target that comes from the cabinet itself. */
    void follow(Message target, long now) throws Refusal {
        check(target);
        if (target instanceof ServoJoints) {
            checkJoints(((ServoJoints) target).q, server.robot.info(), "q");
        }
        steer(target, now);
    }

    private static void check(Message message) throws Refusal {
        try {
            message.validate("");
        } catch (Violation e) {
            throw new Refusal(e.code, e.parameter, e.value, e.allowed, e.getMessage());
        }
    }

    /** Hands a servo target over; nothing is answered, a refused one is told of in the status of the stream. */
    private void steer(Message message, long sent) {
        Stream stream;
        Stream.Target target;
        double[] joints = null;
        if (message instanceof ServoJoints) {
            ServoJoints one = (ServoJoints) message;
            joints = one.q;
            stream = streamOf(one.servo);
            target = new Stream.Target(one.q, null, null, null, one.watchdog, sent);
        } else if (message instanceof ServoJointsVelocity) {
            ServoJointsVelocity one = (ServoJointsVelocity) message;
            joints = one.q;
            stream = streamOf(one.servo);
            target = new Stream.Target(one.q, one.dq, null, null, one.watchdog, sent);
        } else {
            ServoPose one = (ServoPose) message;
            stream = streamOf(one.servo);
            target = new Stream.Target(null, null, one.xyz, one.quat, one.watchdog, sent);
        }
        if (stream == null) {
            return; // it has just ended; its client hears of that
        }
        try {
            message.validate("");
            if (joints != null) {
                checkJoints(joints, server.robot.info(), "q");
            }
            ServoRules.check(stream.open.engine, target);
            stream.offer(target);
        } catch (Violation e) {
            stream.refuse(new Refusal(e.code, e.parameter, e.value, e.allowed, e.getMessage()));
        } catch (Refusal e) {
            stream.refuse(e);
        }
    }

    private void fail(Client client, int type, long request, Throwable e) {
        server.log.error("message " + type + " of " + client.name(), e);
        refuse(client, request, new Refusal(Code.INTERNAL, String.valueOf(e)));
    }

    private void refuse(Client client, long request, Refusal why) {
        client.answer(new Rejected(why.code, why.parameter, why.value, why.allowed, why.getMessage()), request);
    }

    private Message act(Client client, Message message) throws Refusal {
        long id = 0;
        if (message instanceof Stop) {
            server.executor.stop(((Stop) message).kind);
        } else if (message instanceof Run) {
            id = run((Run) message);
        } else if (message instanceof ServoOpen) {
            server.rack.checkMoved(((ServoOpen) message).frame, "frame");
            checkMode(((ServoOpen) message).mode, "mode.");
            checkUntil((ServoOpen) message);
            ServoRules.check((ServoOpen) message);
            server.robot.check((ServoOpen) message);
            server.warden.check();
            id = server.executor.open(new Stream(server, (ServoOpen) message));
        } else if (message instanceof ServoSettings) {
            checkMode(((ServoSettings) message).mode, "mode.");
            running(((ServoSettings) message).servo).change(((ServoSettings) message).mode);
        } else if (message instanceof ServoClose) {
            running(((ServoClose) message).servo);
            server.executor.cancel(((ServoClose) message).servo);
        } else if (message instanceof FriOpen) {
            id = open((FriOpen) message);
        } else if (message instanceof FriClose) {
            close((FriClose) message);
        } else if (message instanceof Cancel) {
            server.executor.cancel(((Cancel) message).id);
        } else if (message instanceof Subscribe) {
            Subscribe wish = (Subscribe) message;
            if (wish.rate > server.config.maxRate) {
                throw new Refusal(Code.OUT_OF_RANGE, "rate", Double.toString(wish.rate), "[0, " + server.config.maxRate + "] Hz",
                        "this cabinet pushes at most " + server.config.maxRate + " states a second");
            }
            server.sampler.subscribe(client, wish.groups, wish.rate);
        } else if (message instanceof TakeControl) {
            TakeControl wish = (TakeControl) message;
            server.authority.take(client, wish.watchdog, wish.on_lost);
        } else if (message instanceof ReleaseControl) {
            server.authority.release(client, client.name() + " released control");
        } else if (message instanceof Pause) {
            server.robot.pause();
        } else if (message instanceof Resume) {
            server.robot.resume();
        } else if (message instanceof SetOverride) {
            server.robot.setOverride(((SetOverride) message).value);
        } else if (Fitting.concerns(message)) {
            Fitting.make(server, message);
        } else if (message instanceof Recover) {
            server.warden.recover();
        } else if (Panel.concerns(message)) {
            return Panel.answer(server, message);
        } else {
            throw new Refusal(Code.UNSUPPORTED, "this cabinet application cannot handle message " + message.type() + " yet");
        }
        return new Accepted(id);
    }

    /** The stream of a servo motion that runs or is about to; null if it is none, or has ended. */
    private Stream streamOf(long servo) {
        Activity activity = server.executor.activity(servo);
        return activity instanceof Stream ? (Stream) activity : null;
    }

    private Stream running(long servo) throws Refusal {
        Stream stream = streamOf(servo);
        if (stream == null) {
            throw new Refusal(Code.UNKNOWN_MOTION, "servo", Long.toString(servo), "", "servo motion " + servo + " is not running");
        }
        return stream;
    }

    private long open(FriOpen open) throws Refusal {
        checkMode(open.mode, "mode.");
        FriRules.check(open.io, server.robot.signals());
        server.robot.check(open);
        FriRun run = new FriRun(server, open);
        if (!run.onlyMonitors()) {
            server.warden.check();
            return server.executor.open(run);
        }
        long id = server.executor.number();
        server.monitors.open(id, run);
        return id;
    }

    private void close(FriClose close) throws Refusal {
        if (server.executor.activity(close.session) instanceof FriRun) {
            server.executor.cancel(close.session);
        } else if (!server.monitors.close(close.session)) {
            throw new Refusal(Code.UNKNOWN_MOTION, "session", Long.toString(close.session), "",
                    "FRI session " + close.session + " is not open");
        }
    }

    private long run(Run run) throws Refusal {
        RobotInfo info = server.robot.info();
        for (int i = 0; i < run.items.length; i++) {
            Item item = run.items[i];
            String path = "items[" + i + "].";
            if (item.motion instanceof Ptp) {
                checkJoints(((Ptp) item.motion).q, info, path + "motion.q");
            } else if (item.motion instanceof JointSpline) {
                JointPoint[] points = ((JointSpline) item.motion).points;
                for (int k = 0; k < points.length; k++) {
                    checkJoints(points[k].q, info, path + "motion.points[" + k + "].q");
                }
            }
            if (item.motion instanceof HandGuide) {
                GuideRules.check(item, info, path);
            }
            server.rack.checkMoved(item.frame, path + "frame");
            if (item.motion instanceof LinRel) {
                server.rack.checkReference(((LinRel) item.motion).reference, path + "motion.reference");
            }
            checkMode(item.mode, path + "mode.");
            checkCondition(item.until, path + "until");
            Triggers.check(server, item, path);
            if (item.motion instanceof Hold && Conditions.contains(item.until, PathReached.class)) {
                throw new Refusal(Code.BAD_CONDITION, path + "until", "PathReached", "", "a hold has no path");
            }
            server.robot.check(item, path);
        }
        server.warden.check();
        return server.executor.add(run);
    }

    void checkCondition(Condition condition, String path) throws Refusal {
        Conditions.check(condition, path, server.robot.signals());
        for (int i = 0; i < condition.nodes.length; i++) {
            server.rack.checkReference(Conditions.frame(condition.nodes[i]), path + ".nodes[" + i + "].frame");
        }
    }

    private void checkUntil(ServoOpen open) throws Refusal {
        checkCondition(open.until, "until");
        if (Conditions.contains(open.until, PathReached.class)) {
            throw new Refusal(Code.BAD_CONDITION, "until", "PathReached", "", "a servo motion has no path of its own");
        }
    }

    private void checkMode(Mode mode, String path) throws Refusal {
        ModeRules.check(mode, path);
        server.rack.checkReference(ModeRules.frame(mode), path + (mode instanceof SineImpedance ? "base.frame" : "frame"));
    }

    private static void checkJoints(double[] q, RobotInfo info, String path) throws Refusal {
        for (int i = 0; i < q.length; i++) {
            if (q[i] < info.q_min[i] - 1e-9 || q[i] > info.q_max[i] + 1e-9) {
                throw new Refusal(Code.JOINT_LIMIT, path + "[" + i + "]", Double.toString(q[i]),
                        "[" + info.q_min[i] + ", " + info.q_max[i] + "] rad",
                        "A" + (i + 1) + " would be at " + Math.round(Math.toDegrees(q[i]) * 100) / 100.0 + " deg; the "
                                + info.title + " allows " + Math.round(Math.toDegrees(info.q_min[i])) + " to "
                                + Math.round(Math.toDegrees(info.q_max[i])) + " deg");
            }
        }
    }
}
