package com.kuka.common.concurrent;

/** Only imports of it are known; there is nothing to call. */
public interface IWaitToken {
}
