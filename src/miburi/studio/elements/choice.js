// A list to choose from: the browser's own, which every keyboard, phone and screen reader knows.
export default {
  template: `<div class="choice"><span class="field-label" aria-hidden="true">{{ label }}</span>
    <select class="plain-button" :aria-label="label" :value="modelValue" @change="$emit('update:model-value', $event.target.value)">
      <option v-for="[value, text] in options" :key="value" :value="value">{{ text }}</option>
    </select></div>`,
  props: { modelValue: String, options: Array, label: String },
  emits: ["update:model-value"],
};
