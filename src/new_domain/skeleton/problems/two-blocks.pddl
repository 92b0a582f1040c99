; For `groundloop plan --domain NAME --problem …`: one block onto another.
(define (problem two-blocks)
  (:domain NAME)
  (:objects red_block green_block - block arm - arm-type)
  (:init
    (on-table red_block) (clear red_block)
    (on-table green_block) (clear green_block)
    (empty-handed arm))
  (:goal (on red_block green_block)))
