package heptarm.core.session;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.state.StateSampler;
import heptarm.wire.Accepted;
import heptarm.wire.Code;
import heptarm.wire.GetDatagramStatistics;
import heptarm.wire.Message;
import heptarm.wire.Messages;
import heptarm.wire.OpenDatagrams;
import heptarm.wire.Pause;
import heptarm.wire.Ping;
import heptarm.wire.Pong;
import heptarm.wire.Recover;
import heptarm.wire.Rejected;
import heptarm.wire.ReleaseControl;
import heptarm.wire.Resume;
import heptarm.wire.SessionState;
import heptarm.wire.SessionTransitions;
import heptarm.wire.Stop;
import heptarm.wire.Subscribe;
import heptarm.wire.TakeControl;
import heptarm.wire.WireException;

/** Dispatches the messages of open sessions, and answers every refused request with the reason. */
final class RequestDispatcher {
    /** Longest age of a datagram of an observer [s]. */
    private static final double OBSERVER = 0.5;

    private final ControlAuthority authority;
    private final CommandHandler commands;
    private final StateSampler sampler;
    private final double maxRate;
    private final Log log;

    RequestDispatcher(ControlAuthority authority, CommandHandler commands, StateSampler sampler, double maxRate, Log log) {
        this.authority = authority;
        this.commands = commands;
        this.sampler = sampler;
        this.maxRate = maxRate;
        this.log = log;
    }

    /** Handle one frame in the client's reader thread. Nothing that a client sends causes an exception beyond this method. */
    void handle(ClientConnection client, int type, long request, long sent, byte[] data, int offset, int length) {
        try {
            Message message = Messages.read(type, data, offset, length);
            if (message == null || !Messages.fromClient(type)) {
                throw new CommandRejected(Code.UNKNOWN_MESSAGE, "message " + type + " is unknown here; update heptarm on the cabinet");
            }
            SessionState next = SessionTransitions.next(SessionState.OPEN, type);
            if (next == null) {
                throw new CommandRejected(Code.UNEXPECTED_MESSAGE, "message " + type + " is illegal in an open session");
            }
            if (next == SessionState.CLOSED) {
                client.leave("it said goodbye");
                return;
            }
            if (message instanceof Ping) {
                client.outbox.answer(new Pong(((Ping) message).sent, client.silence.lastReceived()), 0);
                return;
            }
            if (message instanceof Pong) {
                return;
            }
            if (Messages.needsControl(type) && !authority.isController(client)) {
                throw notInControl(client);
            }
            if (CommandHandler.isTarget(type)) {
                commands.stream(message, sent, request);
                return;
            }
            CommandHandler.validate(message);
            client.outbox.answer(answer(client, message), request);
        } catch (WireException e) {
            reject(client, type, request, new CommandRejected(Code.BAD_BODY, "message " + type + ": " + e.getMessage()));
        } catch (CommandRejected e) {
            reject(client, type, request, e);
        } catch (RuntimeException e) {
            fail(client, type, request, e);
        } catch (LinkageError e) { // a class that this cabinet lacks
            fail(client, type, request, e);
        }
    }

    /**
     * Handle a servo target, a Stop or a Cancel that came as datagram. It is never answered: what is wrong with a Stop or a
     * Cancel is the answer over TCP, and a target is refused in the status of its stream.
     */
    void handleDatagram(ClientConnection client, int type, long request, long sent, byte[] data, int offset, int length) {
        try {
            Message message = Messages.read(type, data, offset, length);
            if (Messages.needsControl(type) && !authority.isController(client)) {
                return;
            }
            if (CommandHandler.isTarget(type)) {
                commands.stream(message, sent, request);
                return;
            }
            CommandHandler.validate(message);
            answer(client, message);
        } catch (WireException e) { // its tag is right: a client with a defect
            log.warn("a datagram of " + client.name() + " with message " + type + ": " + e.getMessage());
        } catch (CommandRejected e) { // the same request over TCP is answered
        } catch (RuntimeException e) {
            log.error("a datagram of " + client.name() + " with message " + type, e);
        }
    }

    /** Longest age of a datagram of the client [s]: of the controller its watchdog time. */
    double patience(ClientConnection client) {
        return authority.isController(client) ? authority.watchdog() : OBSERVER;
    }

    private Message answer(ClientConnection client, Message message) throws CommandRejected {
        if (message instanceof Subscribe) {
            Subscribe request = (Subscribe) message;
            if (request.rate > maxRate) {
                throw new CommandRejected(Code.OUT_OF_RANGE, "rate", Double.toString(request.rate), "[0, " + maxRate + "] Hz",
                        "rate must be in [0, " + maxRate + "] Hz on this cabinet, got " + request.rate
                                + " Hz; ask for less, raise the process data heptarm.max_rate, or use FRI");
            }
            sampler.subscribe(client, request.groups, request.rate);
        } else if (message instanceof Stop) {
            commands.stop(((Stop) message).kind, "by " + client.name() + " at " + client.host(), !authority.isController(client));
        } else if (message instanceof TakeControl) {
            TakeControl request = (TakeControl) message;
            authority.take(client, request.watchdog, request.on_lost);
        } else if (message instanceof ReleaseControl) {
            authority.release(client, client.name() + " released control");
        } else if (message instanceof OpenDatagrams) {
            return client.datagrams.open();
        } else if (message instanceof GetDatagramStatistics) {
            return client.datagrams.counts();
        } else {
            return command(client, message);
        }
        return new Accepted(0);
    }

    /**
     * Execute a command. Its checks take a while, in which the client may lose control; what ended its motions has not seen this one
     * then, so it ends here.
     */
    private Message command(ClientConnection client, Message message) throws CommandRejected {
        Message answer = commands.answer(message);
        if (CommandHandler.begins(message) && !authority.isController(client)) {
            commands.withdraw(message, ((Accepted) answer).id);
            throw notInControl(client);
        }
        if (message instanceof Pause || message instanceof Resume || message instanceof Recover) {
            authority.paused(message instanceof Pause);
        }
        return answer;
    }

    private CommandRejected notInControl(ClientConnection client) {
        String controller = authority.name();
        return new CommandRejected(Code.NOT_IN_CONTROL, "controller", controller, "",
                controller.length() == 0 ? "nobody controls the robot"
                        : controller.equals(client.name()) ? "another client named " + controller
                                + " controls the robot; give each client a name of its own"
                        : controller + " controls the robot, not " + client.name());
    }

    private void fail(ClientConnection client, int type, long request, Throwable e) {
        log.error("message " + type + " of " + client.name(), e);
        reject(client, type, request, new CommandRejected(Code.INTERNAL, String.valueOf(e)));
    }

    private static void reject(ClientConnection client, int type, long request, CommandRejected why) {
        long id = CommandHandler.isTarget(type) ? 0 : request; // a target has a number there
        client.outbox.answer(new Rejected(why.code, why.parameter, why.value, why.allowed, why.getMessage()), id);
    }
}
